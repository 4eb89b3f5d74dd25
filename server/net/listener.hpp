// Takes connections and keeps count of them. On the network thread alone.
//
// Asio appears in this header, which only listener.cpp and server.cpp include.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <vector>

#include "server/app/command_line.hpp"
#include "server/net/server_context.hpp"

namespace enfilade::server {

class Listener {
 public:
  /// Throws ServerError.
  Listener(boost::asio::io_context& context, const Endpoint& where, Worlds& worlds,
           const ServerLimits& limits, Access access);

  std::uint16_t port() const { return port_; }
  void start();
  /// Takes no more connections and ends those that there are.
  void stop();

 private:
  void accept();
  void take(boost::asio::ip::tcp::socket socket);
  bool makeRoom(const Connection& newcomer);

  boost::asio::ip::tcp::acceptor acceptor_;
  const std::uint16_t port_;  ///< asked once: other threads want to know it
  boost::asio::steady_timer pause_;
  Reception reception_;
};

}  // namespace enfilade::server
