#include "server/worlds/work_pool.hpp"

#include <algorithm>
#include <atomic>
#include <thread>

namespace enfilade::server {

WorkPool::WorkPool() : WorkPool(std::clamp(std::thread::hardware_concurrency(), 1u, 16u)) {}

WorkPool::WorkPool(unsigned threads) {
  for (unsigned i = 0; i < threads; ++i) threads_.push_back(std::make_unique<WorkThread>());
}

void WorkPool::post(std::vector<std::function<void()>> work) {
  struct Shared {
    std::vector<std::function<void()>> work;
    std::atomic<std::size_t> next{0};
  };
  const auto shared = std::make_shared<Shared>();
  shared->work = std::move(work);
  const std::size_t helpers = std::min(threads_.size(), shared->work.size());
  const std::size_t first = first_.fetch_add(helpers);
  for (std::size_t i = 0; i < helpers; ++i) {
    threads_[(first + i) % threads_.size()]->post([shared] {
      while (true) {
        const std::size_t mine = shared->next++;
        if (mine >= shared->work.size()) return;
        shared->work[mine]();
      }
    });
  }
}

void WorkPool::finish() {
  for (const auto& thread : threads_) thread->finish();
}

}  // namespace enfilade::server
