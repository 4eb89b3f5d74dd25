// The rigid bodies of a world in the solver, and every entity that they met so far, with the last
// tick's impulses and features. The commands determine all of it; a copy of a world must copy it.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "collision/compound/overlapping_parts.hpp"
#include "scene/physics/physics_world.hpp"
#include "scene/physics/step_report.hpp"
#include "scene/world/data/body.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// Block size of parallel loops over bodies.
inline constexpr std::size_t kBodiesPerTask = 32;

/// Fronts of an active body's pairs with bodies of many parts, by the other physics body.
using PartFronts = std::map<std::uint32_t, collision::PartFront>;

struct DynamicBodies {
  PhysicsWorld physicsWorld;
  std::vector<std::uint32_t> bodyIndices;  ///< of rigid bodies, into WorldData::bodies
  /// Index into physicsWorld's bodies by (entity, part); an avatar has one per part, others only
  /// part 0. Those of `bodyIndices` are first, in their order; others are created when first met.
  std::map<std::pair<EntityId, std::uint32_t>, std::uint32_t> physicsBodyByPart;
  std::vector<EntityId> entities;            ///< of each physics body; 0: unused
  std::vector<std::uint32_t> freeSlots;      ///< physics bodies of avatars that left, for reuse
  std::vector<std::uint32_t> sceneBodyOf;    ///< by physics body: index into WorldData::bodies
  std::vector<std::uint32_t> physicsBodyOf;  ///< by WorldData::bodies; kNoBody: not met yet
  std::vector<std::uint32_t> activeBodies;   ///< awake or possibly woken in this tick, ascending
  /// By physics body of a rigid body. Not part of the state: only the cost of candidate pairs
  /// depends on it.
  std::vector<PartFronts> partFronts;
  StepReport lastReport;  ///< of the last tick with an awake body
  /// Pairs of an avatar and a rigid body that exchanged an impulse in this tick, even if they are
  /// separated at its end; ascending.
  std::vector<std::pair<EntityId, EntityId>> avatarBodyPairs;
};

}  // namespace enfilade::scene
