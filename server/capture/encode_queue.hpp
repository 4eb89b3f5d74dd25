// Worker threads that encode and write frames while the next frames are rendered.
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
  /// At most `maxPending` tasks are queued or running. Both parameters are at least 1.
  EncodeQueue(std::size_t threads, std::size_t maxPending);
  ~EncodeQueue();  ///< waits for all tasks

  /// Adds a task; blocks while the queue is full. Rethrows the exception of a failed task; no
  /// further task then starts.
  void post(std::function<void()> work);
  /// Waits for all tasks. Rethrows the exception of a failed task.
  void finish();

 private:
  void finishTask(std::exception_ptr failure);

  const std::size_t maxPending_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t pending_ = 0;
  std::size_t next_ = 0;
  std::exception_ptr failure_;                        ///< of the first failed task
  std::vector<std::unique_ptr<WorkThread>> threads_;  // last member: the threads use the others
};

}  // namespace enfilade::server
