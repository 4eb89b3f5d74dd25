#include "server/base/work_thread.hpp"

namespace enfilade::server {

WorkThread::WorkThread() : thread_([this] { run(); }) {}

WorkThread::~WorkThread() {
  finish();
}

void WorkThread::post(std::function<void()> work) {
  {
    const std::lock_guard lock(mutex_);
    work_.push_back(std::move(work));
  }
  changed_.notify_one();
}

void WorkThread::postAfter(std::chrono::milliseconds time, std::function<void()> work) {
  {
    const std::lock_guard lock(mutex_);
    later_.emplace(std::chrono::steady_clock::now() + time, std::move(work));
  }
  changed_.notify_one();
}

void WorkThread::finish() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

/// With the lock: what is due joins the work.
void WorkThread::takeDue() {
  const auto now = std::chrono::steady_clock::now();
  while (!later_.empty() && later_.begin()->first <= now) {
    work_.push_back(std::move(later_.begin()->second));
    later_.erase(later_.begin());
  }
}

void WorkThread::run() {
  for (;;) {
    std::unique_lock lock(mutex_);
    takeDue();
    if (work_.empty() && finishing_) return;
    if (work_.empty()) {
      if (later_.empty())
        changed_.wait(lock);
      else
        changed_.wait_until(lock, later_.begin()->first);
      continue;
    }
    const std::function<void()> work = std::move(work_.front());
    work_.pop_front();
    lock.unlock();
    work();
  }
}

}  // namespace enfilade::server
