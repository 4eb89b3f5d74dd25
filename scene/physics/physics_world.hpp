// PhysicsWorld: rigid bodies, and the pairs of their parts that may touch. The caller supplies
// candidate pairs (broad phase). Nothing here depends on the scene's world.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/base/thread_pool.hpp"
#include "scene/physics/body_pair.hpp"
#include "scene/physics/physics_body.hpp"

namespace enfilade::scene {

struct PhysicsWorld {
  std::vector<PhysicsBody> bodies;
  std::vector<BodyPair> pairs;  ///< ascending by key; set by setPairs()
};

/// Bounding sphere of a dynamic body's motion in a step, in metres.
struct MotionSphere {
  Vec3 centre = Vec3::Zero();
  double radius = 0;
};
MotionSphere computeMotionSphere(const PhysicsBody& body);

/// Returns whether the contents of two spheres can come within `margin` metres of each other.
inline bool mayMeet(const MotionSphere& a, const MotionSphere& b, double margin) {
  const double maxDistance = (a.radius + b.radius + margin) * kRoundUpFactor;
  return !((a.centre - b.centre).squaredNorm() > maxDistance * maxDistance);
}

/// Replaces the candidate pairs. They are ascending, with a < b, and at least one body is dynamic.
/// State of pairs that existed before is kept. `pool` null: the caller's thread alone.
void setPairs(PhysicsWorld& world, std::span<const PartPairKey> candidates,
              ThreadPool* pool = nullptr);

/// Discards all pair state of a body. Call it after its shape changed.
void erasePairs(PhysicsWorld& world, std::uint32_t body);

}  // namespace enfilade::scene
