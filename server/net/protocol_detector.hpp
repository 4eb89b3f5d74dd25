// Who has connected and is not known yet: the first bytes tell whether it speaks this protocol or
// HTTP. What is neither goes to a Session, which says what is wrong.
//
// Asio appears in this header, which only files of connections include.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/net/server_context.hpp"

namespace enfilade::server {

class Arrival : public Connection, public std::enable_shared_from_this<Arrival> {
 public:
  Arrival(boost::asio::ip::tcp::socket socket, Reception& reception);
  void start();
  void end(v1::ErrorCode code, const std::string& reason) override;
  bool giveWay() override;

 private:
  enum class Language : std::uint8_t { unknownYet, ours, http };

  void read();
  Language language() const;
  void become(Language language);

  boost::asio::ip::tcp::socket socket_;
  boost::asio::steady_timer timer_;
  Reception& reception_;
  std::array<std::uint8_t, 4096> in_{};
  std::size_t count_ = 0;  ///< of bytes that came
  bool gone_ = false;      ///< somebody else has the socket
  v1::ErrorCode endCode_ = v1::ERROR_UNSPECIFIED;
  std::string endReason_;  ///< not empty: it is to be told this
};

}  // namespace enfilade::server
