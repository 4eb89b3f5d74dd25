// A rigid motion of some of an avatar's parts within a tick, cast against its obstacles. These are
// the parts that a joint moves, or all that turn with the avatar.
#pragma once

#include <cstdint>

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

static_assert(kMaxParts + kMaxLinks <= 64, "RigidStep::movedParts has a bit per part");

/// The requested motion, scene frame.
struct RigidStep {
  std::uint64_t movedParts = 0;  ///< bit i: part i of Avatar::shape
  bool isRotation = false;       ///< about pivot and axis; otherwise along the axis
  Vec3 pivot = Vec3::Zero();
  Vec3 axis = Vec3::UnitY();   ///< unit
  double delta = 0;            ///< radians or metres
  double maxDisplacement = 0;  ///< metres: bound on the displacement of any point in the step
};

/// The earliest hit of a step.
struct RigidStepHit {
  double fraction = 1;  ///< of the step up to about one contact offset before the obstacle
  EntityId entity = 0;  ///< 0: none
  collision::SeparationResult separation;
};

/// True if a cast of a step may hit something: an obstacle, or its own parts if its chain has self
/// contact. `reach` contains all moved parts during the step and one contact offset around them.
bool mayHit(const Avatar& avatar, const Aabb& reach);

/// Casts the moved parts against the avatar's obstacles and, if its chain has self contact, against
/// its parts that do not move. Updates the obstacles' caches.
RigidStepHit castRigidStep(const WorldSettings& settings, Avatar& avatar, const RigidStep& step,
                           QueryCount& count);

/// Records the obstacle of a step, unless the move of this tick has met one before.
void recordStepHit(Avatar& avatar, const RigidStepHit& hit);

}  // namespace enfilade::scene
