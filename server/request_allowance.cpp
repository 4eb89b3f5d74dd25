#include "server/request_allowance.hpp"

#include <algorithm>

namespace enfilade::server {
namespace {

constexpr std::size_t kMostRequests = 1024;         // of one client under way
constexpr std::chrono::nanoseconds kPrice{20'000};  // of one request: 50,000 a second
constexpr std::chrono::milliseconds kBurst{100};    // may be paid for ahead

}  // namespace

RequestAllowance::RequestAllowance(const ServerLimits& limits, std::function<void()> wake)
    : mostBytes_(limits.waitingBytes), wake_(std::move(wake)) {}

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
    if (!waiting_ || requests_ > kMostRequests / 2 || bytes_ > mostBytes_ / 2) return;
    waiting_ = false;
  }
  wake_();
}

bool RequestAllowance::full() const {
  return requests_ >= kMostRequests || bytes_ >= mostBytes_;
}

RequestAllowance::Clock::duration RequestAllowance::pace(Clock::time_point now) {
  paid_ = std::max(paid_, now) + kPrice;
  return std::max<Clock::duration>(paid_ - now - kBurst, {});
}

}  // namespace enfilade::server
