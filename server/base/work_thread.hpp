// WorkThread: a thread that runs posted tasks in order.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

namespace enfilade::server {

class WorkThread {
 public:
  WorkThread();
  ~WorkThread();  ///< calls finish()
  WorkThread(const WorkThread&) = delete;
  WorkThread& operator=(const WorkThread&) = delete;

  /// Callable from any thread. `work` must not throw. Do not post after finish().
  void post(std::function<void()> work);
  /// Like post(), after a delay. Work that is not due at finish() is discarded.
  void postAfter(std::chrono::milliseconds delay, std::function<void()> work);
  /// Waits until all posted work is done.
  void finish();

 private:
  void run();
  void queueDueWork();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> queue_;
  std::multimap<std::chrono::steady_clock::time_point, std::function<void()>> delayed_;  ///< by due
  bool finishing_ = false;
  std::thread thread_;  // last member: it uses the others
};

}  // namespace enfilade::server
