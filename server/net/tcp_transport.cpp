#include "server/net/tcp_transport.hpp"

#include <poll.h>

#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>

namespace enfilade::server {
namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

std::string told(const error_code& problem) {
  return problem ? problem.message() : std::string();
}

}  // namespace

std::array<asio::const_buffer, 2> piecesOf(const Encoded& message) {
  return {asio::buffer(*message.head),
          message.rest ? asio::buffer(*message.rest) : asio::const_buffer()};
}

std::string addressOf(const tcp::socket& socket) {
  error_code problem;
  const tcp::endpoint endpoint = socket.remote_endpoint(problem);
  if (problem) return "a client that is gone";
  return endpoint.address().to_string() + ":" + std::to_string(endpoint.port());
}

bool peerEnded(tcp::socket& socket) {
  pollfd asked{socket.native_handle(), POLLRDHUP, 0};
  return ::poll(&asked, 1, 0) > 0;  // it, an error or a hang-up
}

TcpWire::TcpWire(tcp::socket socket, std::vector<std::uint8_t> first)
    : socket_(std::move(socket)), peer_(addressOf(socket_)), first_(std::move(first)) {}

void TcpWire::read(Heard done) {
  if (!first_.empty()) {
    return asio::post(socket_.get_executor(), [this, done = std::move(done)] {
      const std::vector<std::uint8_t> first = std::exchange(first_, {});
      done("", first);
    });
  }
  socket_.async_read_some(asio::buffer(in_),
                          [this, done = std::move(done)](error_code problem, std::size_t bytes) {
                            done(told(problem), {in_.data(), bytes});
                          });
}

void TcpWire::write(Encoded message, Written done) {
  const auto pieces = piecesOf(message);
  asio::async_write(socket_, pieces,
                    [message = std::move(message), done = std::move(done)](
                        error_code problem, std::size_t) { done(told(problem)); });
}

void TcpWire::endSending(std::function<void()> done) {
  error_code ignored;
  socket_.shutdown(tcp::socket::shutdown_send, ignored);
  done();
}

bool TcpWire::peerEnded() {
  return server::peerEnded(socket_);
}

void TcpWire::close() {
  error_code ignored;
  socket_.close(ignored);
}

}  // namespace enfilade::server
