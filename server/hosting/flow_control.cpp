#include "server/hosting/flow_control.hpp"

#include <algorithm>

#include "collision/assert.hpp"

namespace enfilade::server {
namespace {

constexpr std::chrono::milliseconds kBurst{100};  // of requests above the average rate

}  // namespace

FlowControl::FlowControl(const ServerLimits& limits, std::function<void()> wake)
    : maxRequests_(limits.pendingRequests),
      maxBytes_(limits.pendingRequestBytes),
      requestPeriod_(std::chrono::nanoseconds(std::chrono::seconds(1)) / limits.requestsPerSecond),
      wake_(std::move(wake)) {}

RequestPermit FlowControl::acquire(std::size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    ++requests_;
    bytes_ += bytes;
  }
  return {nullptr, [self = shared_from_this(), bytes](void*) { self->release(bytes); }};
}

bool FlowControl::hasCapacity() {
  const std::lock_guard lock(mutex_);
  readerWaiting_ = isFull();
  return !readerWaiting_;
}

void FlowControl::release(std::size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    ENFILADE_ASSERT(requests_ > 0 && bytes_ >= bytes);
    --requests_;
    bytes_ -= bytes;
    // Hysteresis: resume at half of the capacity, so that reading happens in batches.
    if (!readerWaiting_ || requests_ > maxRequests_ / 2 || bytes_ > maxBytes_ / 2) return;
    readerWaiting_ = false;
  }
  wake_();
}

bool FlowControl::isFull() const {
  return requests_ >= maxRequests_ || bytes_ >= maxBytes_;
}

FlowControl::Clock::duration FlowControl::throttle(Clock::time_point now) {
  paidUntil_ = std::max(paidUntil_, now) + requestPeriod_;
  return std::max<Clock::duration>(paidUntil_ - now - kBurst, {});
}

}  // namespace enfilade::server
