// Threads that encode and write while the next pictures are drawn, a bounded number at a time.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "server/base/work_thread.hpp"

namespace enfilade::server {

class EncodeQueue {
 public:
  /// At most `most` pieces of work are in hand at once, waiting or being done. Both at least 1.
  EncodeQueue(std::size_t threads, std::size_t most);
  ~EncodeQueue();  ///< finishes

  /// Waits while too much is in hand. Throws what a piece of work threw; nothing more is begun
  /// then.
  void post(std::function<void()> work);
  /// Waits until all is done. Throws what a piece of work threw.
  void finish();

 private:
  void done(std::exception_ptr failure);

  const std::size_t most_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t inHand_ = 0;
  std::size_t next_ = 0;
  std::exception_ptr failure_;                        ///< the first one
  std::vector<std::unique_ptr<WorkThread>> threads_;  // last: they use the others
};

}  // namespace enfilade::server
