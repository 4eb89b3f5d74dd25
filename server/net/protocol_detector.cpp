#include "server/net/protocol_detector.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <string_view>

#include "collision/assert.hpp"
#include "server/log/log.hpp"
#include "server/net/http_session.hpp"
#include "server/net/session.hpp"
#include "server/net/tcp_transport.hpp"

namespace enfilade::server {
namespace asio = boost::asio;
using boost::system::error_code;

namespace {

/// A peer that vanished without closing is noticed within two minutes; the system's default is two
/// hours, for which it would drive the clock.
void setKeepAlive(asio::ip::tcp::socket& socket) {
  using Idle = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPIDLE>;
  using Interval = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPINTVL>;
  using Count = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_KEEPCNT>;
  error_code ignored;
  socket.set_option(asio::socket_base::keep_alive(true), ignored);
  socket.set_option(Idle(60), ignored);      // seconds without data until the first probe
  socket.set_option(Interval(10), ignored);  // seconds between probes
  socket.set_option(Count(6), ignored);
}

}  // namespace

ProtocolDetector::ProtocolDetector(asio::ip::tcp::socket socket, ServerContext& context)
    : socket_(std::move(socket)), timer_(socket_.get_executor()), context_(context) {}

void ProtocolDetector::start() {
  error_code ignored;  // the first read reports a closed peer
  socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
  setKeepAlive(socket_);
  const int sendBuffer = context_.limits.sendBuffer;
  if (sendBuffer > 0) socket_.set_option(asio::socket_base::send_buffer_size(sendBuffer), ignored);
  timer_.expires_after(context_.limits.helloTimeout);
  timer_.async_wait([weak = weak_from_this()](error_code stopped) {
    const auto self = weak.lock();
    if (stopped || !self || self->finished_) return;
    error_code none;
    self->socket_.cancel(none);  // the read ends, and a Session reports the timeout
  });
  read();
}

/// Cancels the read; a Session then sends the reason.
void ProtocolDetector::end(v1::ErrorCode code, const std::string& reason) {
  if (finished_) return;
  endCode_ = code;
  endReason_ = reason;
  error_code none;
  socket_.cancel(none);
}

bool ProtocolDetector::evictIfAnonymous() {
  if (finished_) return false;
  finished_ = true;
  timer_.cancel();
  logWarning("{}: sent nothing and was replaced by a new connection", formatPeerAddress(socket_));
  error_code none;
  socket_.close(none);
  return true;
}

void ProtocolDetector::read() {
  ENFILADE_ASSERT(receivedBytes_ < in_.size());
  const auto room = asio::buffer(in_.data() + receivedBytes_, in_.size() - receivedBytes_);
  socket_.async_read_some(room, [self = shared_from_this()](error_code problem, std::size_t count) {
    if (self->finished_) return;
    self->receivedBytes_ += count;
    const bool stopped = problem == asio::error::operation_aborted;
    if (problem && !stopped) {
      self->finished_ = true;
      self->timer_.cancel();
      logInfo("{} left without sending data: {}", formatPeerAddress(self->socket_),
              problem.message());
      return;
    }
    const Protocol detected = stopped ? Protocol::enfilade : self->detect();
    if (detected == Protocol::unknown) return self->read();
    self->handOver(detected);
  });
}

ProtocolDetector::Protocol ProtocolDetector::detect() const {
  constexpr std::string_view kHttpMethods[] = {"GET ", "HEAD", "POST", "PUT ",
                                               "DELE", "OPTI", "PATC", "CONN"};
  constexpr std::size_t kMinBytes = 4;
  const std::string_view received(reinterpret_cast<const char*>(in_.data()),
                                  std::min(receivedBytes_, kMinBytes));
  const std::string_view magic(reinterpret_cast<const char*>(protocol::kMagic.data()), kMinBytes);
  const auto mayBe = [&](std::string_view word) { return word.starts_with(received); };
  const bool http = std::any_of(std::begin(kHttpMethods), std::end(kHttpMethods), mayBe);
  if (!http && !mayBe(magic)) return Protocol::enfilade;
  if (received.size() < kMinBytes) return Protocol::unknown;
  return http ? Protocol::http : Protocol::enfilade;
}

void ProtocolDetector::handOver(Protocol detected) {
  ENFILADE_ASSERT(!finished_ && detected != Protocol::unknown);
  finished_ = true;
  const auto deadline = timer_.expiry();
  timer_.cancel();
  const auto executor = socket_.get_executor();
  std::vector<std::uint8_t> first(in_.begin(),
                                  in_.begin() + static_cast<std::ptrdiff_t>(receivedBytes_));
  if (detected == Protocol::http) {
    const auto httpSession =
        std::make_shared<HttpSession>(std::move(socket_), std::move(first), context_);
    if (isFull_) httpSession->admitOnlyHealthChecks();
    registerConnection(context_, httpSession);
    return httpSession->start(deadline);
  }
  const auto session = std::make_shared<Session>(
      std::make_unique<TcpTransport>(std::move(socket_), std::move(first)), executor, context_);
  session->start(deadline);
  registerConnection(context_, session);
  if (isFull_) session->end(v1::ERROR_NOT_ALLOWED, kServerIsFull);
  if (!endReason_.empty()) session->end(endCode_, endReason_);
}

}  // namespace enfilade::server
