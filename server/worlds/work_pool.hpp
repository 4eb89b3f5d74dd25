// WorkPool: a thread pool for short tasks.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "server/base/work_thread.hpp"

namespace enfilade::server {

class WorkPool {
 public:
  /// With a thread per processor, up to 16.
  WorkPool();
  explicit WorkPool(unsigned threads);

  /// Runs all of it, in any order and on several threads. Does not wait. No work may throw.
  /// Callable from any thread, until finish().
  void post(std::vector<std::function<void()>> work);
  /// Waits until all posted work is done.
  void finish();

 private:
  std::vector<std::unique_ptr<WorkThread>> threads_;
  std::atomic<std::size_t> first_ = 0;  ///< thread of the next call: groups of clients share all
};

}  // namespace enfilade::server
