// A few threads that share loops. What a loop computes must not depend on who computes it: each
// index writes to places of its own. The blocks of indices are fixed. Each thread begins with the
// same share of them in every loop, since what it wrote there in the last one is near to it, and
// then helps with what the others have not taken; the caller waits for nobody who has not begun. So
// a thread that the machine has no processor for costs nothing.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <thread>
#include <vector>

namespace enfilade::scene {

class Workers {
 public:
  /// `threads`: with the caller's, 1 to kMost; less or more than that are taken as these.
  explicit Workers(int threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  static constexpr int kMost = 64;
  int count() const { return static_cast<int>(helpers_.size()) + 1; }

  /// Calls each(begin, end) for blocks of `block` indices below `size`, and returns when all are
  /// done. Where calls threw, one of their exceptions is thrown again.
  template <class Each>
  void share(std::size_t size, std::size_t block, const Each& each) {
    if (helpers_.empty() || size <= block) {
      if (size > 0) each(std::size_t{0}, size);
      return;
    }
    const auto call = [](const void* what, std::size_t from, std::size_t to) {
      (*static_cast<const Each*>(what))(from, to);
    };
    runOnAll({call, &each, size, block});
  }

 private:
  struct Job {
    void (*call)(const void*, std::size_t, std::size_t) = nullptr;
    const void* what = nullptr;
    std::size_t size = 0, block = 1;
  };
  void runOnAll(const Job& job);
  void help(std::size_t helper);
  void takeShare(std::size_t share);
  void takeBlocks(std::size_t thread) noexcept;

  /// Of the blocks of a job, beside one another; each on a cache line of its own.
  struct alignas(64) Share {
    std::atomic<std::size_t> next{0};  ///< the first block that nobody took
    std::size_t end = 0;
  };
  Job job_;                              ///< changes only while nobody is inside, as the shares do
  std::vector<Share> shares_;            ///< one for each thread
  std::atomic<std::uint32_t> gate_{0};   ///< kOpen, and how many helpers are inside
  std::atomic<std::uint32_t> round_{0};  ///< counts jobs; who waits for one waits here
  std::atomic<bool> ending_{false};
  std::vector<std::exception_ptr> failures_;
  std::vector<std::jthread> helpers_;
};

/// The same by the caller alone where there are no workers.
template <class Each>
void shareAmong(Workers* workers, std::size_t size, std::size_t block, const Each& each) {
  if (workers) {
    workers->share(size, block, each);
  } else if (size > 0) {
    each(std::size_t{0}, size);
  }
}

}  // namespace enfilade::scene
