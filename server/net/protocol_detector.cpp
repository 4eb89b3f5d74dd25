#include "server/net/protocol_detector.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <string_view>

#include "server/net/http_session.hpp"
#include "server/net/session.hpp"
#include "server/net/tcp_transport.hpp"

namespace enfilade::server {
namespace asio = boost::asio;
using boost::system::error_code;

Arrival::Arrival(asio::ip::tcp::socket socket, Reception& reception)
    : socket_(std::move(socket)), timer_(socket_.get_executor()), reception_(reception) {}

void Arrival::start() {
  error_code ignored;  // a peer that is gone already is told by the first read
  socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
  socket_.set_option(asio::socket_base::keep_alive(true), ignored);
  const int sendBuffer = reception_.limits.sendBuffer;
  if (sendBuffer > 0) socket_.set_option(asio::socket_base::send_buffer_size(sendBuffer), ignored);
  timer_.expires_after(reception_.limits.greeting);
  timer_.async_wait([weak = weak_from_this()](error_code stopped) {
    const auto self = weak.lock();
    if (stopped || !self || self->gone_) return;
    error_code none;
    self->socket_.cancel(none);  // the read ends, and a Session tells that the time is over
  });
  read();
}

/// The read ends, and a Session tells the reason.
void Arrival::end(v1::ErrorCode code, const std::string& reason) {
  if (gone_) return;
  endCode_ = code;
  endReason_ = reason;
  error_code none;
  socket_.cancel(none);
}

bool Arrival::giveWay() {
  if (gone_) return false;
  gone_ = true;
  timer_.cancel();
  spdlog::warn("{}: said nothing, and a newcomer takes its place", addressOf(socket_));
  error_code none;
  socket_.close(none);
  return true;
}

void Arrival::read() {
  const auto room = asio::buffer(in_.data() + count_, in_.size() - count_);
  socket_.async_read_some(room, [self = shared_from_this()](error_code problem, std::size_t count) {
    if (self->gone_) return;
    self->count_ += count;
    const bool stopped = problem == asio::error::operation_aborted;
    if (problem && !stopped) {
      self->gone_ = true;
      self->timer_.cancel();
      spdlog::info("{} left without a word: {}", addressOf(self->socket_), problem.message());
      return;
    }
    const Language language = stopped ? Language::ours : self->language();
    if (language == Language::unknownYet) return self->read();
    self->become(language);
  });
}

Arrival::Language Arrival::language() const {
  constexpr std::string_view kMethods[] = {"GET ", "HEAD", "POST", "PUT ",
                                           "DELE", "OPTI", "PATC", "CONN"};
  constexpr std::size_t kEnough = 4;
  const std::string_view came(reinterpret_cast<const char*>(in_.data()), std::min(count_, kEnough));
  const std::string_view magic(reinterpret_cast<const char*>(protocol::kMagic.data()), kEnough);
  const auto mayBe = [&](std::string_view word) { return word.starts_with(came); };
  const bool http = std::any_of(std::begin(kMethods), std::end(kMethods), mayBe);
  if (!http && !mayBe(magic)) return Language::ours;
  if (came.size() < kEnough) return Language::unknownYet;
  return http ? Language::http : Language::ours;
}

void Arrival::become(Language language) {
  gone_ = true;
  const auto deadline = timer_.expiry();
  timer_.cancel();
  const auto executor = socket_.get_executor();
  std::vector<std::uint8_t> first(in_.begin(), in_.begin() + static_cast<std::ptrdiff_t>(count_));
  if (language == Language::http) {
    const auto visit =
        std::make_shared<HttpVisit>(std::move(socket_), std::move(first), reception_);
    enlist(reception_, visit);
    return visit->start(deadline);
  }
  const auto session = std::make_shared<Session>(
      std::make_unique<TcpWire>(std::move(socket_), std::move(first)), executor, reception_);
  session->start(deadline);
  enlist(reception_, session);
  if (!endReason_.empty()) session->end(endCode_, endReason_);
}

}  // namespace enfilade::server
