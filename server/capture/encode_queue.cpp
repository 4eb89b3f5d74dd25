#include "server/capture/encode_queue.hpp"

namespace enfilade::server {

EncodeQueue::EncodeQueue(std::size_t threads, std::size_t maxPending) : maxPending_(maxPending) {
  for (std::size_t i = 0; i < threads; ++i) threads_.push_back(std::make_unique<WorkThread>());
}

EncodeQueue::~EncodeQueue() {
  for (const auto& thread : threads_) thread->finish();
}

void EncodeQueue::post(std::function<void()> work) {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return pending_ < maxPending_ || failure_; });
    if (failure_) std::rethrow_exception(failure_);
    ++pending_;
  }
  threads_[next_++ % threads_.size()]->post([this, work = std::move(work)] {
    std::exception_ptr failure;
    try {
      work();
    } catch (...) {
      failure = std::current_exception();
    }
    finishTask(failure);
  });
}

void EncodeQueue::finishTask(std::exception_ptr failure) {
  {
    const std::lock_guard lock(mutex_);
    --pending_;
    if (failure && !failure_) failure_ = std::move(failure);
  }
  changed_.notify_all();
}

void EncodeQueue::finish() {
  for (const auto& thread : threads_) thread->finish();
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
}

}  // namespace enfilade::server
