#include "scene/base/parallel_for.hpp"

#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace enfilade::scene {

void parallelFor(std::size_t count, int threads, const std::function<void(double)>& progress,
                 const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0}, done{0};
  std::exception_ptr failure;
  std::mutex failureMutex;
  if (progress) progress(0);  // other threads may do all the work
  const auto run = [&](bool reports) {
    try {
      for (std::size_t i = next++; i < count; i = next++) {
        work(i);
        ++done;
        if (reports && progress) progress(static_cast<double>(done) / static_cast<double>(count));
      }
    } catch (...) {
      const std::lock_guard lock(failureMutex);
      failure = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> workers;
    for (int i = 1; i < threads; ++i) workers.emplace_back(run, false);
    run(true);
  }
  if (failure) std::rethrow_exception(failure);
  if (progress) progress(1);  // other threads may have finished last
}

}  // namespace enfilade::scene
