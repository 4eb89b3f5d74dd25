// A thread that does what it is given, in order.
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
  ~WorkThread();  ///< finishes
  WorkThread(const WorkThread&) = delete;
  WorkThread& operator=(const WorkThread&) = delete;

  /// `work` must not throw. Nothing may be given after finish().
  void post(std::function<void()> work);
  /// The same, after some time; what is not due when the thread finishes is not done.
  void postAfter(std::chrono::milliseconds time, std::function<void()> work);
  /// Waits until all is done.
  void finish();

 private:
  void run();
  void takeDue();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> work_;
  std::multimap<std::chrono::steady_clock::time_point, std::function<void()>> later_;  ///< by due
  bool finishing_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace enfilade::server
