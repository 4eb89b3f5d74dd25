#include "server/net/listener.hpp"

#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>

#include "server/net/protocol_detector.hpp"
#include "server/net/server.hpp"

namespace enfilade::server {
namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

std::string textOf(const Endpoint& where) {
  return where.host + ":" + std::to_string(where.port);
}

tcp::endpoint endpointOf(const Endpoint& where) {
  error_code problem;
  const std::string host = where.host == "localhost" ? "127.0.0.1" : where.host;
  const asio::ip::address address = asio::ip::make_address(host, problem);
  if (problem) {
    throw ServerError("cannot listen on " + textOf(where) +
                      ": give an address in numbers, as 127.0.0.1, or localhost");
  }
  return {address, where.port};
}

void refuseStrangers(const Endpoint& where, const tcp::endpoint& endpoint, const Access& access) {
  if (endpoint.address().is_loopback()) return;
  if (access.tokens.empty() || !access.insecure) {
    throw ServerError("will not listen on " + textOf(where) +
                      ": others can reach that address, and what is said is not encrypted. Stay on "
                      "127.0.0.1 and use a tunnel, as ssh -L, or a proxy that brings TLS; or give "
                      "--token-file and --insecure");
  }
}

tcp::acceptor acceptorAt(asio::io_context& context, const Endpoint& where, const Access& access) {
  const tcp::endpoint endpoint = endpointOf(where);
  refuseStrangers(where, endpoint, access);
  tcp::acceptor acceptor(context);
  try {
    acceptor.open(endpoint.protocol());
    acceptor.set_option(tcp::acceptor::reuse_address(true));
    acceptor.bind(endpoint);
    acceptor.listen();
  } catch (const boost::system::system_error& error) {
    throw ServerError("cannot listen on " + textOf(where) + ": " + error.code().message() +
                      "; is another server there? port 0 lets the system choose");
  }
  return acceptor;
}

}  // namespace

Listener::Listener(asio::io_context& context, const Endpoint& where, Worlds& worlds,
                   const ServerLimits& limits, Access access)
    : acceptor_(acceptorAt(context, where, access)),
      port_(acceptor_.local_endpoint().port()),
      pause_(context),
      reception_{worlds, limits, std::move(access), {}} {}

void Listener::start() {
  accept();
}

void Listener::accept() {
  acceptor_.async_accept([this](error_code problem, tcp::socket socket) {
    if (!acceptor_.is_open()) return;
    if (!problem) {
      take(std::move(socket));
      return accept();
    }
    // Out of file descriptors, most likely: trying again at once would spin.
    spdlog::error("a connection could not be taken: {}", problem.message());
    pause_.expires_after(std::chrono::seconds(1));
    pause_.async_wait([this](error_code stopped) {
      if (!stopped) accept();
    });
  });
}

void Listener::take(tcp::socket socket) {
  const auto arrival = std::make_shared<Arrival>(std::move(socket), reception_);
  arrival->start();
  enlist(reception_, arrival);
  if (reception_.connections.size() > reception_.limits.connections && !makeRoom(*arrival))
    arrival->end(v1::ERROR_NOT_ALLOWED,
                 "the server has all the clients it takes: come again when one has left");
}

/// The one who came first of those who have not said who they are gives way: silence must not keep
/// others out.
bool Listener::makeRoom(const Connection& newcomer) {
  for (const auto& weak : reception_.connections) {
    const auto connection = weak.lock();
    if (connection && connection.get() != &newcomer && connection->giveWay()) return true;
  }
  return false;
}

void Listener::stop() {
  error_code ignored;
  acceptor_.close(ignored);
  pause_.cancel();
  reception_.closed = true;
  const auto connections = reception_.connections;  // who ends may enlist a successor
  for (const auto& weak : connections) {
    if (const auto connection = weak.lock())
      connection->end(v1::ERROR_SHUTTING_DOWN, "the server ends");
  }
}

}  // namespace enfilade::server
