// Threads for the parallel loops of a world's tick. No result depends on them, so they are not part
// of the state.
#pragma once

#include <cstddef>
#include <memory>

#include "scene/base/thread_pool.hpp"

namespace enfilade::scene {

struct WorldThreads {
  int maxThreads = 0;                ///< 0: two, or one on a single processor
  std::unique_ptr<ThreadPool> pool;  ///< once a loop was long enough
  int poolSize = 0;                  ///< threads of `pool`
};

/// Bodies that are active in a tick, below which waking a thread costs more than it gains.
inline constexpr std::size_t kMinParallelBodies = 64;
/// The same for avatars that move.
inline constexpr std::size_t kMinParallelAvatars = 16;

/// The thread pool for a loop over `items`; null below `minItems`, or if only one thread may run.
ThreadPool* acquireThreadPool(WorldThreads& threads, std::size_t items, std::size_t minItems);

}  // namespace enfilade::scene
