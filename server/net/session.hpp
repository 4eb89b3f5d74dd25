// The connection of one client: converts bytes to messages and back for the tick loop.
// It lives on the network thread as long as one of its reads, writes or timers is in progress.
//
// This header uses Asio; only connection files include it.
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

class Session : public ClientConnection, public std::enable_shared_from_this<Session> {
 public:
  Session(std::unique_ptr<Transport> transport, boost::asio::any_io_executor executor,
          ServerContext& context);

  /// The complete Hello must arrive before `deadline`. `token`: from the transport's handshake.
  void start(std::chrono::steady_clock::time_point deadline, std::string token = {});
  /// Sends Bye and closes within ServerLimits::closeTimeout.
  void end(v1::ErrorCode code, const std::string& reason) override;
  bool evictIfAnonymous() override;

 private:
  using ErrorCode = boost::system::error_code;
  using Timer = boost::asio::steady_timer;

  void read();
  void handleBytes(std::span<const std::uint8_t> bytes);
  void handleMessage(const protocol::Message& message);
  void handleHello(const v1::ClientMessage& message);
  void joinWorld(const v1::Hello& hello, Role role, std::uint64_t requestId);
  void fail(v1::ErrorCode code, const std::string& reason, std::uint64_t requestId = 0);
  void continueReading();
  void pauseReading(Timer::time_point end);
  void startMessageTimer();
  void sendNext();
  void onWritten(const std::string& problem, bool last);
  void armTimer(Timer::time_point deadline, v1::ErrorCode code, std::string reason);
  void startCloseTimer();
  void close(const std::string& reason);

  const std::unique_ptr<Transport> transport_;
  const boost::asio::any_io_executor executor_;
  Timer timer_;
  ServerContext& context_;
  std::string peer_;  ///< for logs: address, port, and the client's name
  std::string token_;
  protocol::Decoder decoder_;
  std::shared_ptr<OutgoingQueue> out_;
  std::shared_ptr<FlowControl> flowControl_;
  Timer pauseTimer_;                     ///< delays reading when requests come too fast
  FlowControl::Clock::duration debt_{};  ///< time by which the requests exceed the rate
  bool reading_ = false;
  bool sending_ = false;
  std::shared_ptr<TickLoop> world_;  ///< the entered world
  ClientId client_ = 0;              ///< 0: no Hello yet
  bool messageIncomplete_ = false;
  bool listening_ = true;           ///< false: further input is discarded
  bool closeTimerStarted_ = false;  ///< the close timer is running
  bool closed_ = false;
};

}  // namespace enfilade::server
