#include "server/base/work_thread.hpp"

namespace enfilade::server {

WorkThread::WorkThread() : thread_([this] { run(); }) {}

WorkThread::~WorkThread() {
  finish();
}

void WorkThread::post(std::function<void()> work) {
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(std::move(work));
  }
  changed_.notify_one();
}

void WorkThread::postAfter(std::chrono::milliseconds delay, std::function<void()> work) {
  {
    const std::lock_guard lock(mutex_);
    delayed_.emplace(std::chrono::steady_clock::now() + delay, std::move(work));
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

/// Moves due delayed work into the queue. The caller holds the lock.
void WorkThread::queueDueWork() {
  const auto now = std::chrono::steady_clock::now();
  while (!delayed_.empty() && delayed_.begin()->first <= now) {
    queue_.push_back(std::move(delayed_.begin()->second));
    delayed_.erase(delayed_.begin());
  }
}

void WorkThread::run() {
  for (;;) {
    std::unique_lock lock(mutex_);
    queueDueWork();
    if (queue_.empty() && finishing_) return;
    if (queue_.empty()) {
      if (delayed_.empty())
        changed_.wait(lock);
      else
        changed_.wait_until(lock, delayed_.begin()->first);
      continue;
    }
    const std::function<void()> work = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    work();
  }
}

}  // namespace enfilade::server
