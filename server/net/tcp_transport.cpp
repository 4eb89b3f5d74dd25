#include "server/net/tcp_transport.hpp"

#include <poll.h>

#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>

namespace enfilade::server {
namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

std::string formatProblem(const error_code& problem) {
  return problem ? problem.message() : std::string();
}

std::array<asio::const_buffer, 2> makeBuffers(const EncodedMessage& message) {
  return {asio::buffer(*message.head),
          message.body ? asio::buffer(*message.body) : asio::const_buffer()};
}

std::string formatPeerAddress(const tcp::socket& socket) {
  error_code problem;
  const tcp::endpoint endpoint = socket.remote_endpoint(problem);
  if (problem) return "a disconnected client";
  return endpoint.address().to_string() + ":" + std::to_string(endpoint.port());
}

bool hasPeerClosed(tcp::socket& socket) {
  pollfd pollRequest{socket.native_handle(), POLLRDHUP, 0};
  return ::poll(&pollRequest, 1, 0) > 0;  // closed, an error, or a hang-up
}

TcpTransport::TcpTransport(tcp::socket socket, std::vector<std::uint8_t> first)
    : socket_(std::move(socket)), peer_(formatPeerAddress(socket_)), first_(std::move(first)) {}

void TcpTransport::read(ReadHandler done) {
  if (!first_.empty()) {
    return asio::post(socket_.get_executor(), [this, done = std::move(done)] {
      const std::vector<std::uint8_t> first = std::exchange(first_, {});
      done("", first);
    });
  }
  socket_.async_read_some(asio::buffer(in_),
                          [this, done = std::move(done)](error_code problem, std::size_t bytes) {
                            done(formatProblem(problem), {in_.data(), bytes});
                          });
}

void TcpTransport::write(EncodedMessage message, WriteHandler done) {
  const auto pieces = makeBuffers(message);
  asio::async_write(socket_, pieces,
                    [message = std::move(message), done = std::move(done)](
                        error_code problem, std::size_t) { done(formatProblem(problem)); });
}

void TcpTransport::shutdownSend(std::function<void()> done) {
  error_code ignored;
  socket_.shutdown(tcp::socket::shutdown_send, ignored);
  done();
}

bool TcpTransport::peerClosed() {
  return server::hasPeerClosed(socket_);
}

void TcpTransport::close() {
  error_code ignored;
  socket_.close(ignored);
}

}  // namespace enfilade::server
