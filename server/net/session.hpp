// One client: bytes to messages and back. What a message means is the tick loop's to know.
// Lives on the network thread as long as one of its reads, writes or timers is under way.
//
// Asio appears in this header, which only those files include that take connections.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <string>

#include "protocol/framing.hpp"
#include "server/hosting/flow_control.hpp"
#include "server/net/server_context.hpp"
#include "server/net/transport.hpp"

namespace enfilade::server {

class Session : public Connection, public std::enable_shared_from_this<Session> {
 public:
  Session(std::unique_ptr<Wire> wire, boost::asio::any_io_executor executor, Reception& reception);

  /// The whole Hello has to be here by `deadline`. `token` is what the wire's own greeting had.
  void start(std::chrono::steady_clock::time_point deadline, std::string token = {});
  /// Says goodbye and closes, within ServerLimits::farewell.
  void end(v1::ErrorCode code, const std::string& reason) override;
  bool giveWay() override;

 private:
  using ErrorCode = boost::system::error_code;
  using Timer = boost::asio::steady_timer;

  void read();
  void takeBytes(std::span<const std::uint8_t> bytes);
  void take(const protocol::Message& message);
  void greet(const v1::ClientMessage& message);
  void enter(const v1::Hello& hello, Role role, std::uint64_t requestId);
  void fail(v1::ErrorCode code, const std::string& reason, std::uint64_t requestId = 0);
  void keepReading();
  void pause(Timer::time_point end);
  void timeHalfMessage();
  void sendNext();
  void written(const std::string& problem, bool last);
  void armTimer(Timer::time_point deadline, v1::ErrorCode code, std::string reason);
  void sayGoodbye();
  void close(const std::string& why);

  const std::unique_ptr<Wire> wire_;
  const boost::asio::any_io_executor executor_;
  Timer timer_;
  Reception& reception_;
  std::string peer_;  ///< for logs: address and port, and the name that it gave itself
  std::string token_;
  protocol::Decoder decoder_;
  std::shared_ptr<OutgoingQueue> out_;
  std::shared_ptr<RequestAllowance> allowance_;
  Timer pause_;                                ///< of reading, where requests come too fast
  RequestAllowance::Clock::duration ahead_{};  ///< by how much they do
  bool reading_ = false;
  bool sending_ = false;
  std::shared_ptr<TickLoop> world_;  ///< that it entered
  ClientId client_ = 0;              ///< 0: not greeted
  bool messageHalfway_ = false;
  bool listening_ = true;     ///< false: what still comes is thrown away
  bool saidGoodbye_ = false;  ///< the farewell timer runs
  bool closed_ = false;
};

}  // namespace enfilade::server
