// Thread pool for parallel loops. Results must not depend on the thread: each index writes only its
// own data. Blocks of indices are fixed. Each thread starts with the same range in every loop, for
// cache locality, and then helps with unfinished ranges. The caller waits only for threads that
// have started, so a thread without a free processor costs nothing.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <thread>
#include <vector>

namespace enfilade::scene {

/// Runs parallel loops on the caller and a fixed number of worker threads.
class ThreadPool {
 public:
  /// `threads`: number of threads with the caller, clamped to 1..kMaxThreads.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  static constexpr int kMaxThreads = 64;
  int threadCount() const { return static_cast<int>(workers_.size()) + 1; }

  /// Calls each(begin, end) for blocks of `block` indices below `size`, and returns when all are
  /// done. Rethrows one exception if calls threw.
  template <class Each>
  void parallelFor(std::size_t size, std::size_t block, const Each& each) {
    if (workers_.empty() || size <= block) {
      if (size > 0) each(std::size_t{0}, size);
      return;
    }
    const auto call = [](const void* function, std::size_t from, std::size_t to) {
      (*static_cast<const Each*>(function))(from, to);
    };
    runOnAll({call, &each, size, block});
  }

 private:
  struct Job {
    void (*call)(const void*, std::size_t, std::size_t) = nullptr;
    const void* function = nullptr;
    std::size_t size = 0, block = 1;
  };
  void runOnAll(const Job& job);
  void workerLoop(std::size_t worker);
  void runRange(std::size_t index);
  void runBlocks(std::size_t thread) noexcept;

  /// The blocks of a job that a thread takes first. Each range has a cache line of its own.
  struct alignas(64) BlockRange {
    std::atomic<std::size_t> next{0};  ///< the first block that is not taken
    std::size_t end = 0;
  };
  Job job_;                             ///< changes only while no worker is inside, like the ranges
  std::vector<BlockRange> ranges_;      ///< one per thread
  std::atomic<std::uint32_t> gate_{0};  ///< kOpen, and the number of workers inside
  std::atomic<std::uint32_t> jobCounter_{0};  ///< counts jobs; workers wait on it
  std::atomic<bool> stopping_{false};
  std::vector<std::exception_ptr> failures_;
  std::vector<std::jthread> workers_;
};

/// parallelFor(), or a serial call where `pool` is null.
template <class Each>
void parallelForOrSerial(ThreadPool* pool, std::size_t size, std::size_t block, const Each& each) {
  if (pool) {
    pool->parallelFor(size, block, each);
  } else if (size > 0) {
    each(std::size_t{0}, size);
  }
}

}  // namespace enfilade::scene
