#include "server/net/websocket_transport.hpp"

#include <boost/beast/websocket/rfc6455.hpp>

#include "protocol/framing.hpp"
#include "server/base/version.hpp"
#include "server/net/tcp_transport.hpp"

namespace enfilade::server {
namespace asio = boost::asio;
namespace websocket = boost::beast::websocket;
using boost::system::error_code;

namespace {

constexpr std::chrono::seconds kHandshake{10};
constexpr std::size_t kReadAtOnce = 1 << 16;  // bytes

std::string told(const error_code& problem) {
  return problem ? problem.message() : std::string();
}

}  // namespace

WebSocketWire::WebSocketWire(asio::ip::tcp::socket socket, Request request)
    : peer_(addressOf(socket) + " by WebSocket"),
      stream_(std::move(socket)),
      request_(std::move(request)) {
  constexpr std::size_t kLengths = 8;  // bytes, of the framing
  stream_.read_message_max(protocol::kServerTakes.total + kLengths);
  stream_.binary(true);
  stream_.auto_fragment(false);
  // Silence is allowed, as over TCP, and a client whose requests wait in its socket cannot be heard
  // answering pings. Half a message is the session's to time.
  stream_.set_option(
      websocket::stream_base::timeout{kHandshake, websocket::stream_base::none(), false});
  stream_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(boost::beast::http::field::server, std::string("enfilade ") + kServerVersion);
  }));
}

/// The first read answers the upgrade first. Nothing is written before it: Session answers Hello.
void WebSocketWire::read(Heard done) {
  if (accepted_) return readMessage(std::move(done));
  stream_.async_accept(request_, [this, done = std::move(done)](error_code problem) mutable {
    if (problem) return done(problem.message(), {});
    accepted_ = true;
    readMessage(std::move(done));
  });
}

void WebSocketWire::readMessage(Heard done) {
  in_.clear();
  // In pieces as they come, so that the session knows when half a message stays half.
  stream_.async_read_some(in_, kReadAtOnce,
                          [this, done = std::move(done)](error_code problem, std::size_t) {
                            if (problem) return done(problem.message(), {});
                            if (!stream_.got_binary())
                              return done("it sent text; only binary messages are taken", {});
                            const auto data = in_.cdata();
                            done("", {static_cast<const std::uint8_t*>(data.data()), data.size()});
                          });
}

void WebSocketWire::write(Encoded message, Written done) {
  if (!accepted_) return done("the upgrade was not answered yet");
  const auto pieces = piecesOf(message);
  stream_.async_write(pieces, [message = std::move(message), done = std::move(done)](
                                  error_code problem, std::size_t) { done(told(problem)); });
}

void WebSocketWire::endSending(std::function<void()> done) {
  if (!accepted_) return done();
  stream_.async_close(websocket::close_code::normal,
                      [done = std::move(done)](error_code) { done(); });
}

bool WebSocketWire::peerEnded() {
  return server::peerEnded(stream_.next_layer());
}

void WebSocketWire::close() {
  error_code ignored;
  stream_.next_layer().close(ignored);
}

}  // namespace enfilade::server
