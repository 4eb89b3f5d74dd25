// One connection: bytes to messages and back. What a message means is the tick loop's to know.
// Lives on the network thread as long as one of its reads, writes or timers is under way.
//
// Asio appears in this header, which only session.cpp and listener.cpp include.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <string>

#include "protocol/framing.hpp"
#include "server/tick_loop.hpp"

namespace enfilade::server {

class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(boost::asio::ip::tcp::socket socket, TickLoop& loop, const ServerLimits& limits);

  void start();
  /// Says goodbye and closes, within ServerLimits::farewell.
  void end(v1::ErrorCode code, const std::string& reason);

 private:
  using ErrorCode = boost::system::error_code;
  using Timer = boost::asio::steady_timer;

  void read();
  void takeBytes(std::span<const std::uint8_t> bytes);
  void take(const protocol::Message& message);
  void greet(const v1::ClientMessage& message);
  void fail(v1::ErrorCode code, const std::string& reason, std::uint64_t requestId = 0);
  void sendNext();
  void written(ErrorCode problem, bool last);
  void armTimer(std::chrono::milliseconds time, v1::ErrorCode code, std::string reason);
  void sayGoodbye();
  void close(const std::string& why);

  boost::asio::ip::tcp::socket socket_;
  Timer timer_;
  TickLoop& loop_;
  const ServerLimits limits_;
  std::string peer_;  ///< for logs: address and port, and the name that it gave itself
  protocol::Decoder decoder_;
  std::array<std::uint8_t, 1 << 16> in_{};
  std::shared_ptr<OutgoingQueue> out_;
  Buffer sending_;
  ClientId client_ = 0;  ///< 0: not greeted
  bool messageHalfway_ = false;
  bool listening_ = true;     ///< false: what still comes is thrown away
  bool saidGoodbye_ = false;  ///< the farewell timer runs
  bool closed_ = false;
};

}  // namespace enfilade::server
