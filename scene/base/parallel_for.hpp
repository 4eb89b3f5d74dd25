// Parallel loop over long tasks with progress, for example over the tiles of a mesh. ThreadPool is
// for the short loops of a tick.
#pragma once

#include <cstddef>
#include <functional>

namespace enfilade::scene {

/// Calls `work` with 0 to `count` - 1. `progress`, which may be empty, gets the share that is done,
/// first 0; the calling thread reports it. Throws what `work` throws.
void parallelFor(std::size_t count, int threads, const std::function<void(double)>& progress,
                 const std::function<void(std::size_t)>& work);

}  // namespace enfilade::scene
