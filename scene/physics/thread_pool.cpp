// A loop of the solver takes microseconds, so who waits first spins for about as long as it would
// take to be woken, and only then sleeps.
#include "scene/physics/thread_pool.hpp"

#include <system_error>

namespace enfilade::scene {
namespace {

constexpr int kSpins = 5000;  // some 50 us
constexpr std::uint32_t kOpen = 1u << 31;

void pause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

}  // namespace

Workers::Workers(int threads)
    : shares_(static_cast<std::size_t>(std::clamp(threads, 1, kMost))), failures_(shares_.size()) {
  const int count = static_cast<int>(shares_.size());
  helpers_.reserve(static_cast<std::size_t>(count) - 1);
  try {
    for (int i = 1; i < count; ++i)
      helpers_.emplace_back([this, i] { help(static_cast<std::size_t>(i)); });
  } catch (const std::system_error&) {
    // The system gives no more threads: those that there are do it, with the same result.
  }
}

Workers::~Workers() {
  ending_.store(true, std::memory_order_relaxed);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
}

void Workers::takeShare(std::size_t share) {
  Share& own = shares_[share];
  while (true) {  // ends: each turn takes a block
    const std::size_t block = own.next.fetch_add(1, std::memory_order_relaxed);
    if (block >= own.end) return;
    const std::size_t from = block * job_.block;
    job_.call(job_.what, from, std::min(from + job_.block, job_.size));
  }
}

/// Those of its own share first.
void Workers::takeBlocks(std::size_t thread) noexcept {
  try {
    for (std::size_t i = 0; i < shares_.size(); ++i) takeShare((thread + i) % shares_.size());
  } catch (...) {
    failures_[thread] = std::current_exception();
  }
}

void Workers::runOnAll(const Job& job) {
  job_ = job;
  const std::size_t blocks = (job.size + job.block - 1) / job.block;
  for (std::size_t i = 0; i < shares_.size(); ++i) {
    shares_[i].next.store(i * blocks / shares_.size(), std::memory_order_relaxed);
    shares_[i].end = (i + 1) * blocks / shares_.size();
  }
  gate_.store(kOpen, std::memory_order_release);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  takeBlocks(0);
  gate_.fetch_and(~kOpen, std::memory_order_acq_rel);
  // Each has a block in hand at most.
  for (int i = 0; gate_.load(std::memory_order_acquire) != 0; ++i)
    i < kSpins ? pause() : std::this_thread::yield();
  std::exception_ptr first;
  for (std::exception_ptr& failure : failures_) {
    if (failure && !first) first = failure;
    failure = nullptr;
  }
  if (first) std::rethrow_exception(first);
}

void Workers::help(std::size_t helper) {
  std::uint32_t seen = 0;
  while (true) {  // ends with the object
    for (int i = 0; i < kSpins && round_.load(std::memory_order_acquire) == seen; ++i) pause();
    round_.wait(seen, std::memory_order_acquire);
    seen = round_.load(std::memory_order_acquire);
    if (ending_.load(std::memory_order_relaxed)) return;
    std::uint32_t gate = gate_.load(std::memory_order_acquire);
    while ((gate & kOpen) != 0 &&
           !gate_.compare_exchange_weak(gate, gate + 1, std::memory_order_acq_rel)) {
    }
    if ((gate & kOpen) == 0) continue;
    takeBlocks(helper);
    gate_.fetch_sub(1, std::memory_order_release);
  }
}

}  // namespace enfilade::scene
