// Accepts connections and limits their number. Network thread only.
//
// This header uses Asio; only listener.cpp and server.cpp include it.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/base/host_port.hpp"
#include "server/net/server_context.hpp"

namespace enfilade::server {

/// Throws ServerError if the address is no numeric one, or reachable from other machines without
/// permission in `access`.
boost::asio::ip::tcp::endpoint resolveProtected(const HostPort& where, const Access& access);

class Listener {
 public:
  /// Throws ServerError if it cannot listen on the address.
  Listener(boost::asio::io_context& context, const HostPort& where, WorldRegistry& worlds,
           const ServerLimits& limits, Access access, PageFiles page = {});

  std::uint16_t port() const { return port_; }
  void start();
  /// Stops accepting and ends all connections.
  void stop();

 private:
  void accept();
  void acceptSocket(boost::asio::ip::tcp::socket socket);
  bool evictAnonymous(const ClientConnection& newcomer);

  boost::asio::ip::tcp::acceptor acceptor_;
  const std::uint16_t port_;  ///< cached: other threads read it
  boost::asio::steady_timer retryTimer_;
  ServerContext context_;
};

}  // namespace enfilade::server
