#include "scene/physics/physics_world.hpp"

#include <algorithm>
#include <utility>

#include "collision/assert.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kKeysPerTask = 1024;  // pairs that a task matches to old ones

}  // namespace

MotionSphere computeMotionSphere(const PhysicsBody& body) {
  return {body.motion.centre, body.radius + body.maxStepDisplacement};
}

void setPairs(PhysicsWorld& world, std::span<const PartPairKey> candidates, ThreadPool* pool) {
  thread_local std::vector<BodyPair> kept;  // reused by the next call
  std::vector<BodyPair>& pairs = kept;      // a reference that worker threads can see
  pairs.resize(candidates.size());
  parallelForOrSerial(pool, candidates.size(), kKeysPerTask, [&](std::size_t from, std::size_t to) {
    auto old = std::ranges::lower_bound(world.pairs, candidates[from], {}, &BodyPair::key);
    for (std::size_t i = from; i < to; ++i) {
      ENFILADE_ASSERT(candidates[i].a < candidates[i].b && candidates[i].b < world.bodies.size());
      ENFILADE_ASSERT(i == 0 || !(candidates[i] < candidates[i - 1]));
      while (old != world.pairs.end() && old->key < candidates[i]) ++old;
      if (old != world.pairs.end() && old->key == candidates[i]) {
        pairs[i] = std::move(*old);
      } else {
        pairs[i].key = candidates[i];
      }
      pairs[i].gaveImpulse = false;
    }
  });
  std::swap(world.pairs, pairs);
  pairs.clear();
}

void erasePairs(PhysicsWorld& world, std::uint32_t body) {
  std::erase_if(world.pairs,
                [&](const BodyPair& pair) { return pair.key.a == body || pair.key.b == body; });
}

}  // namespace enfilade::scene
