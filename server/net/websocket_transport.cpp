#include "server/net/websocket_transport.hpp"

#include <boost/beast/websocket/rfc6455.hpp>

#include "collision/assert.hpp"
#include "protocol/framing.hpp"
#include "server/base/version.hpp"
#include "server/net/tcp_transport.hpp"

namespace enfilade::server {
namespace asio = boost::asio;
namespace websocket = boost::beast::websocket;
using boost::system::error_code;

namespace {

constexpr std::chrono::seconds kHandshakeTimeout{10}, kIdleTimeout{240};
constexpr std::size_t kMaxReadBytes = 1 << 16;  // bytes

}  // namespace

WebSocketTransport::WebSocketTransport(asio::ip::tcp::socket socket, Request request)
    : peer_(formatPeerAddress(socket) + " by WebSocket"),
      stream_(std::move(socket)),
      request_(std::move(request)) {
  constexpr std::size_t kFramingBytes = 8;
  stream_.read_message_max(protocol::kServerLimits.total + kFramingBytes);
  stream_.binary(true);
  stream_.auto_fragment(false);
  // Pings find peers that vanished, as keep-alive probes do over TCP. While flow control pauses
  // reading, pongs are not received: the timeout is far longer than any pause.
  stream_.set_option(websocket::stream_base::timeout{kHandshakeTimeout, kIdleTimeout, true});
  stream_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(boost::beast::http::field::server, std::string("enfilade ") + kServerVersion);
  }));
}

/// The first read accepts the upgrade. No write precedes it: Session writes only after Hello.
void WebSocketTransport::read(ReadHandler done) {
  if (accepted_) return readMessage(std::move(done));
  stream_.async_accept(request_, [this, done = std::move(done)](error_code problem) mutable {
    if (problem) return done(problem.message(), {});
    accepted_ = true;
    readMessage(std::move(done));
  });
}

void WebSocketTransport::readMessage(ReadHandler done) {
  ENFILADE_ASSERT(accepted_);
  in_.clear();
  // Partial reads, so that the session can time incomplete messages.
  stream_.async_read_some(in_, kMaxReadBytes,
                          [this, done = std::move(done)](error_code problem, std::size_t) mutable {
                            if (problem) return done(problem.message(), {});
                            if (!stream_.got_binary()) return refuseText(std::move(done));
                            const auto data = in_.cdata();
                            done("", {static_cast<const std::uint8_t*>(data.data()), data.size()});
                          });
}

/// Closes with the code of unsupported data, so that the client learns why.
void WebSocketTransport::refuseText(ReadHandler done) {
  constexpr const char* kReason = "only binary messages are supported";
  stream_.async_close(
      {websocket::close_code::unknown_data, kReason},
      [done = std::move(done)](error_code) { done(std::string("it sent text; ") + kReason, {}); });
}

void WebSocketTransport::write(EncodedMessage message, WriteHandler done) {
  if (!accepted_) return done("the upgrade is not accepted yet");
  const auto pieces = makeBuffers(message);
  stream_.async_write(pieces,
                      [message = std::move(message), done = std::move(done)](
                          error_code problem, std::size_t) { done(formatProblem(problem)); });
}

void WebSocketTransport::shutdownSend(std::function<void()> done) {
  if (!accepted_) return done();
  stream_.async_close(websocket::close_code::normal,
                      [done = std::move(done)](error_code) { done(); });
}

bool WebSocketTransport::peerClosed() {
  return server::hasPeerClosed(stream_.next_layer());
}

void WebSocketTransport::close() {
  error_code ignored;
  stream_.next_layer().close(ignored);
}

}  // namespace enfilade::server
