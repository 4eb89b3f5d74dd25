// Asio appears in this header, which only those files include that take connections.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <vector>

#include "server/net/transport.hpp"

namespace enfilade::server {

/// The pieces of a message, for one write.
std::array<boost::asio::const_buffer, 2> piecesOf(const Encoded& message);
std::string addressOf(const boost::asio::ip::tcp::socket& socket);
/// As Wire::peerEnded().
bool peerEnded(boost::asio::ip::tcp::socket& socket);

class TcpWire : public Wire {
 public:
  /// `first` was read already, and comes first.
  TcpWire(boost::asio::ip::tcp::socket socket, std::vector<std::uint8_t> first);
  void read(Heard done) override;
  void write(Encoded message, Written done) override;
  void endSending(std::function<void()> done) override;
  void close() override;
  bool peerEnded() override;
  const std::string& peer() const override { return peer_; }
  bool beginsWithMagic() const override { return true; }

 private:
  boost::asio::ip::tcp::socket socket_;
  const std::string peer_;
  std::vector<std::uint8_t> first_;
  std::array<std::uint8_t, 1 << 16> in_{};
};

}  // namespace enfilade::server
