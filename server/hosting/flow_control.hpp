// Flow control of one client's requests: pending requests, their bytes, and rate. Excess requests
// are not refused. The server stops reading the socket, so that TCP slows the client down and the
// server's memory stays bounded.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>

#include "server/base/server_limits.hpp"

namespace enfilade::server {

/// The share of the capacity that a request occupies until it is answered. Destroying the last copy
/// releases it, on any thread.
using RequestPermit = std::shared_ptr<void>;

class FlowControl : public std::enable_shared_from_this<FlowControl> {
 public:
  using Clock = std::chrono::steady_clock;

  /// `wake` is called when capacity becomes available again: without the lock, from any thread.
  FlowControl(const ServerLimits& limits, std::function<void()> wake);

  RequestPermit acquire(std::size_t bytes);
  /// Whether another request fits. If not, `wake` is called later.
  bool hasCapacity();

  /// Counts a request against the rate. Returns the delay before the next read; 0: no delay. Only
  /// for the network thread.
  Clock::duration throttle(Clock::time_point now);

 private:
  void release(std::size_t bytes);
  bool isFull() const;

  const std::size_t maxRequests_, maxBytes_;
  const std::chrono::nanoseconds requestPeriod_;  ///< time per request at the maximum rate
  const std::function<void()> wake_;
  std::mutex mutex_;  // guards the members below
  std::size_t requests_ = 0, bytes_ = 0;
  bool readerWaiting_ = false;
  Clock::time_point paidUntil_;  ///< network thread only: time up to which the rate is used
};

}  // namespace enfilade::server
