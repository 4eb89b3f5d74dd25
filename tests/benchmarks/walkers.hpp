// Avatars that walk through a scene towards seeded places, like visitors of a building; and the
// clock of their benchmarks.
#pragma once

#include <time.h>

#include <random>
#include <string>

#include "scene/world/world.hpp"

namespace enfilade::benchmarks {

/// Equal on all standard libraries, unlike std::uniform_real_distribution.
inline double drawUniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
}

inline scene::Vec3 drawPlace(std::mt19937_64& random, const scene::Aabb& b) {
  const double x = drawUniform(random, b.min.x(), b.max.x());
  const double y = drawUniform(random, b.min.y(), b.min.y() + 0.7 * b.size().y());
  const double z = drawUniform(random, b.min.z(), b.max.z());
  return {x, y, z};
}

/// Spawns up to `count` avatars; some walk off a building that has no ground around it.
inline void spawnAvatars(scene::World& world, std::size_t count, std::mt19937_64& random) {
  for (std::size_t tries = 0; tries < 200 * count; ++tries) {
    if (world.snapshot()->avatars.size() >= count) return;
    const std::string name = "walker" + std::to_string(world.snapshot()->tick);
    submitAvatarCommand(world, {name, scene::Spawn{drawPlace(random, world.scene().bounds())}, 0});
    tickWorld(world);
  }
}

/// Drives all avatars towards new places at `speed` (m/s).
inline void turnAll(scene::World& world, double speed, std::mt19937_64& random) {
  for (const scene::AvatarSnapshot& avatar : world.snapshot()->avatars) {
    scene::Vec3 way = drawPlace(random, world.scene().bounds()) - avatar.footPosition;
    way.y() = 0;
    submitAvatarCommand(world, {avatar.name, scene::Drive{speed * way.normalized()}, 0});
  }
}

inline double readClock(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}
/// CPU time of this thread, seconds; other load does not count.
inline double readProcessorTime() {
  return readClock(CLOCK_THREAD_CPUTIME_ID);
}
/// The same of all threads of the process.
inline double readTimeOfAllThreads() {
  return readClock(CLOCK_PROCESS_CPUTIME_ID);
}

}  // namespace enfilade::benchmarks
