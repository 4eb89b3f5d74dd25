#include "scene/world/data/world_threads.hpp"

#include <algorithm>
#include <thread>

namespace enfilade::scene {
namespace {

constexpr int kDefaultThreads = 2;

}  // namespace

ThreadPool* acquireThreadPool(WorldThreads& threads, std::size_t items, std::size_t minItems) {
  if (items < minItems) return nullptr;
  const int processors = static_cast<int>(std::thread::hardware_concurrency());
  const int size =
      threads.maxThreads > 0 ? threads.maxThreads : std::min(kDefaultThreads, processors);
  if (size < 2) return nullptr;
  if (!threads.pool || threads.poolSize != size) {
    threads.pool = std::make_unique<ThreadPool>(size);
    threads.poolSize = size;
  }
  return threads.pool.get();
}

}  // namespace enfilade::scene
