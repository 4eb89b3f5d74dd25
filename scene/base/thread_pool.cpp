// A loop of the solver takes microseconds. A waiting worker therefore spins for about the time that
// a wake-up takes, and only then sleeps.
#include "scene/base/thread_pool.hpp"

#include <system_error>

#include "collision/assert.hpp"

namespace enfilade::scene {
namespace {

constexpr int kSpinIterations = 5000;  // about 50 us
constexpr std::uint32_t kOpen = 1u << 31;

void spinPause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

}  // namespace

ThreadPool::ThreadPool(int threads)
    : ranges_(static_cast<std::size_t>(std::clamp(threads, 1, kMaxThreads))),
      failures_(ranges_.size()) {
  const int count = static_cast<int>(ranges_.size());
  workers_.reserve(static_cast<std::size_t>(count) - 1);
  try {
    for (int i = 1; i < count; ++i)
      workers_.emplace_back([this, i] { workerLoop(static_cast<std::size_t>(i)); });
  } catch (const std::system_error&) {
    // The system allows no more threads. The existing ones give the same result.
  }
}

ThreadPool::~ThreadPool() {
  stopping_.store(true, std::memory_order_relaxed);
  jobCounter_.fetch_add(1, std::memory_order_release);
  jobCounter_.notify_all();
}

void ThreadPool::runRange(std::size_t index) {
  BlockRange& own = ranges_[index];
  while (true) {  // ends: each iteration takes a block
    const std::size_t block = own.next.fetch_add(1, std::memory_order_relaxed);
    if (block >= own.end) return;
    const std::size_t from = block * job_.block;
    job_.call(job_.function, from, std::min(from + job_.block, job_.size));
  }
}

/// Runs the thread's own range first.
void ThreadPool::runBlocks(std::size_t thread) noexcept {
  try {
    for (std::size_t i = 0; i < ranges_.size(); ++i) runRange((thread + i) % ranges_.size());
  } catch (...) {
    failures_[thread] = std::current_exception();
  }
}

void ThreadPool::runOnAll(const Job& job) {
  ENFILADE_ASSERT(job.block > 0 && job.size > job.block);
  job_ = job;
  const std::size_t blocks = (job.size + job.block - 1) / job.block;
  for (std::size_t i = 0; i < ranges_.size(); ++i) {
    ranges_[i].next.store(i * blocks / ranges_.size(), std::memory_order_relaxed);
    ranges_[i].end = (i + 1) * blocks / ranges_.size();
  }
  gate_.store(kOpen, std::memory_order_release);
  jobCounter_.fetch_add(1, std::memory_order_release);
  jobCounter_.notify_all();
  runBlocks(0);
  gate_.fetch_and(~kOpen, std::memory_order_acq_rel);
  // Each worker has at most one block left.
  for (int i = 0; gate_.load(std::memory_order_acquire) != 0; ++i)
    i < kSpinIterations ? spinPause() : std::this_thread::yield();
  std::exception_ptr first;
  for (std::exception_ptr& failure : failures_) {
    if (failure && !first) first = failure;
    failure = nullptr;
  }
  if (first) std::rethrow_exception(first);
}

void ThreadPool::workerLoop(std::size_t worker) {
  std::uint32_t lastJob = 0;
  while (true) {  // ends with the destructor
    for (int i = 0; i < kSpinIterations && jobCounter_.load(std::memory_order_acquire) == lastJob;
         ++i)
      spinPause();
    jobCounter_.wait(lastJob, std::memory_order_acquire);
    lastJob = jobCounter_.load(std::memory_order_acquire);
    if (stopping_.load(std::memory_order_relaxed)) return;
    std::uint32_t gate = gate_.load(std::memory_order_acquire);
    while ((gate & kOpen) != 0 &&
           !gate_.compare_exchange_weak(gate, gate + 1, std::memory_order_acq_rel)) {
    }
    if ((gate & kOpen) == 0) continue;
    runBlocks(worker);
    gate_.fetch_sub(1, std::memory_order_release);
  }
}

}  // namespace enfilade::scene
