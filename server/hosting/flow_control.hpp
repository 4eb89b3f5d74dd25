// How much one client may ask before answers come, and how fast. What is above is not refused: its
// socket is not read until there is room again, so that the client's own sending slows down and
// what the server holds of it stays bounded.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>

#include "server/base/server_limits.hpp"

namespace enfilade::server {

/// What requests hold of their client's allowance until they are answered: it is given back when
/// the last copy is gone, on whichever thread.
using RequestHold = std::shared_ptr<void>;

class RequestAllowance : public std::enable_shared_from_this<RequestAllowance> {
 public:
  using Clock = std::chrono::steady_clock;

  /// `wake` is called, without the lock and from any thread, when there is room after there was
  /// none.
  RequestAllowance(const ServerLimits& limits, std::function<void()> wake);

  RequestHold hold(std::size_t bytes);
  /// There is room for one more; if not, `wake` will tell when there is.
  bool hasRoom();

  /// Counts a request against the rate; how long to wait before the next one is read (0: not at
  /// all). Only for the network thread.
  Clock::duration pace(Clock::time_point now);

 private:
  void giveBack(std::size_t bytes);
  bool full() const;

  const std::size_t mostRequests_, mostBytes_;
  const std::chrono::nanoseconds price_;  ///< of one request, in time
  const std::function<void()> wake_;
  std::mutex mutex_;  // guards what follows
  std::size_t requests_ = 0, bytes_ = 0;
  bool waiting_ = false;
  Clock::time_point paid_;  ///< the network thread's: until when requests are paid for
};

}  // namespace enfilade::server
