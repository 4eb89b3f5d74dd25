// The protocol's bytes over TCP.
//
// This header uses Asio; only connection files include it.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <vector>

#include "server/net/transport.hpp"

namespace enfilade::server {

/// The error as text; "" without an error.
std::string formatProblem(const boost::system::error_code& problem);
/// The buffers of a message, for one gathered write.
std::array<boost::asio::const_buffer, 2> makeBuffers(const EncodedMessage& message);
std::string formatPeerAddress(const boost::asio::ip::tcp::socket& socket);
/// Like Transport::peerClosed().
bool hasPeerClosed(boost::asio::ip::tcp::socket& socket);

class TcpTransport : public Transport {
 public:
  /// `first`: bytes already read; read() returns them first.
  TcpTransport(boost::asio::ip::tcp::socket socket, std::vector<std::uint8_t> first);
  void read(ReadHandler done) override;
  void write(EncodedMessage message, WriteHandler done) override;
  void shutdownSend(std::function<void()> done) override;
  void close() override;
  bool peerClosed() override;
  const std::string& peer() const override { return peer_; }
  bool usesMagic() const override { return true; }

 private:
  boost::asio::ip::tcp::socket socket_;
  const std::string peer_;
  std::vector<std::uint8_t> first_;
  std::array<std::uint8_t, 1 << 16> in_{};
};

}  // namespace enfilade::server
