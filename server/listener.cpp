#include "server/listener.hpp"

#include <spdlog/spdlog.h>

#include <boost/asio/io_context.hpp>

#include "server/server.hpp"
#include "server/session.hpp"

namespace enfilade::server {
namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

std::string textOf(const Endpoint& where) {
  return where.host + ":" + std::to_string(where.port);
}

tcp::endpoint loopbackEndpoint(const Endpoint& where) {
  error_code problem;
  const std::string host = where.host == "localhost" ? "127.0.0.1" : where.host;
  const asio::ip::address address = asio::ip::make_address(host, problem);
  if (problem) {
    throw ServerError("cannot listen on " + textOf(where) +
                      ": give an address in numbers, as 127.0.0.1, or localhost");
  }
  if (!address.is_loopback()) {
    throw ServerError("will not listen on " + textOf(where) +
                      ": this version has no token that would keep strangers out, so it takes only "
                      "loopback (127.0.0.1, ::1); use a tunnel, as ssh -L, to reach it");
  }
  return {address, where.port};
}

tcp::acceptor acceptorAt(asio::io_context& context, const Endpoint& where) {
  const tcp::endpoint endpoint = loopbackEndpoint(where);
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

Listener::Listener(asio::io_context& context, const Endpoint& where, TickLoop& loop,
                   const ServerLimits& limits)
    : acceptor_(acceptorAt(context, where)),
      port_(acceptor_.local_endpoint().port()),
      pause_(context),
      loop_(loop),
      limits_(limits) {}

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
  std::erase_if(sessions_, [](const auto& session) { return session.expired(); });
  const bool full = sessions_.size() >= limits_.connections;
  const auto session = std::make_shared<Session>(std::move(socket), loop_, limits_);
  session->start();
  sessions_.push_back(session);
  if (full) session->end(v1::ERROR_NOT_ALLOWED, "the server has all the clients it takes");
}

void Listener::stop() {
  error_code ignored;
  acceptor_.close(ignored);
  pause_.cancel();
  for (const auto& weak : sessions_) {
    if (const auto session = weak.lock()) {
      session->end(v1::ERROR_SHUTTING_DOWN, "the server ends");
    }
  }
}

}  // namespace enfilade::server
