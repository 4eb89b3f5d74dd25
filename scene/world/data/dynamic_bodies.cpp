#include "scene/world/data/dynamic_bodies.hpp"

#include <algorithm>
#include <thread>

namespace enfilade::scene {
namespace {

constexpr std::size_t kMinParallelBodies = 64;  // below, waking a thread costs more
constexpr int kDefaultThreads = 2;

}  // namespace

ThreadPool* acquireThreadPool(DynamicBodies& dynamicBodies) {
  if (dynamicBodies.activeBodies.size() < kMinParallelBodies) return nullptr;
  const int processors = static_cast<int>(std::thread::hardware_concurrency());
  const int threads = std::min(
      dynamicBodies.maxThreads > 0 ? dynamicBodies.maxThreads : kDefaultThreads, processors);
  if (threads < 2) return nullptr;
  if (!dynamicBodies.threadPool || dynamicBodies.threadPoolSize != threads) {
    dynamicBodies.threadPool = std::make_unique<ThreadPool>(threads);
    dynamicBodies.threadPoolSize = threads;
  }
  return dynamicBodies.threadPool.get();
}

}  // namespace enfilade::scene
