// Detects the protocol of a new connection from its first bytes: Enfilade's protocol or HTTP. Any
// other data goes to a Session, which reports the error.
//
// This header uses Asio; only connection files include it.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/net/server_context.hpp"

namespace enfilade::server {

class ProtocolDetector : public ClientConnection,
                         public std::enable_shared_from_this<ProtocolDetector> {
 public:
  ProtocolDetector(boost::asio::ip::tcp::socket socket, ServerContext& context);
  void start();
  /// The server is full: an HTTP request for /healthz or /metrics is answered, others are refused.
  void admitOnlyHealthChecks() { isFull_ = true; }
  void end(v1::ErrorCode code, const std::string& reason) override;
  bool evictIfAnonymous() override;

 private:
  enum class Protocol : std::uint8_t { unknown, enfilade, http };

  void read();
  Protocol detect() const;
  void handOver(Protocol detected);

  boost::asio::ip::tcp::socket socket_;
  boost::asio::steady_timer timer_;
  ServerContext& context_;
  std::array<std::uint8_t, 4096> in_{};
  std::size_t receivedBytes_ = 0;  ///< number of received bytes
  bool isFull_ = false;            ///< see admitOnlyHealthChecks()
  bool finished_ = false;          ///< the socket was handed over or closed
  v1::ErrorCode endCode_ = v1::ERROR_UNSPECIFIED;
  std::string endReason_;  ///< if not empty, sent to the client
};

}  // namespace enfilade::server
