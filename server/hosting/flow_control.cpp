#include "server/hosting/flow_control.hpp"

#include <algorithm>

namespace enfilade::server {
namespace {

constexpr std::chrono::milliseconds kBurst{100};  // may be paid for ahead

}  // namespace

RequestAllowance::RequestAllowance(const ServerLimits& limits, std::function<void()> wake)
    : mostRequests_(limits.requestsUnderWay),
      mostBytes_(limits.waitingBytes),
      price_(std::chrono::nanoseconds(std::chrono::seconds(1)) / limits.requestsPerSecond),
      wake_(std::move(wake)) {}

RequestHold RequestAllowance::hold(std::size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    ++requests_;
    bytes_ += bytes;
  }
  return {nullptr, [self = shared_from_this(), bytes](void*) { self->giveBack(bytes); }};
}

bool RequestAllowance::hasRoom() {
  const std::lock_guard lock(mutex_);
  waiting_ = full();
  return !waiting_;
}

void RequestAllowance::giveBack(std::size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    --requests_;
    bytes_ -= bytes;
    // With half of the room, so that reading goes on in draughts and not in drops.
    if (!waiting_ || requests_ > mostRequests_ / 2 || bytes_ > mostBytes_ / 2) return;
    waiting_ = false;
  }
  wake_();
}

bool RequestAllowance::full() const {
  return requests_ >= mostRequests_ || bytes_ >= mostBytes_;
}

RequestAllowance::Clock::duration RequestAllowance::pace(Clock::time_point now) {
  paid_ = std::max(paid_, now) + price_;
  return std::max<Clock::duration>(paid_ - now - kBurst, {});
}

}  // namespace enfilade::server
