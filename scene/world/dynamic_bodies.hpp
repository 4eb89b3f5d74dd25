// The free bodies of a world as the solver sees them, with all that they met so far. What is here
// beside the bodies themselves are last tick's impulses and features: they follow from the
// commands, as all else does, and a copy of a world must copy them.
#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "scene/physics/physics_world.hpp"
#include "scene/physics/thread_pool.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

inline constexpr std::uint32_t kNoRigid = ~0u;

struct RigidStage {
  Dynamics dynamics;
  std::vector<std::uint32_t> bodies;  ///< indices of the rigid ones into WorldState::bodies
  /// Solids by entity; an avatar has one for each of its parts. Those of `bodies` are the first, in
  /// their order; others are made as they are met.
  std::map<std::pair<EntityId, std::uint32_t>, std::uint32_t> solids;
  std::vector<EntityId> entities;      ///< of each solid; 0: nobody's
  std::vector<std::uint32_t> vacant;   ///< solids of avatars that left, to be used again
  std::vector<std::uint32_t> bodyOf;   ///< of each solid: index into WorldState::bodies; kNoRigid
  std::vector<std::uint32_t> solidOf;  ///< of each body, once it is met; kNoRigid
  std::vector<std::uint32_t> bodyAt;   ///< of each mover up to the last body's; kNoRigid
  std::unique_ptr<Workers> workers;    ///< once there are many bodies; no part of the state
  int workersAsked = 0;                ///< with so many threads
  int threads = 0;                     ///< that may be used; 0: kThreads, or the processors
  std::vector<std::uint32_t> seeds;    ///< bodies whose surroundings matter in this tick, ascending
  DynamicsReport last;                 ///< of the last tick in which a body was awake
  /// Avatars, and free bodies that met them in this tick, be they apart again; ascending.
  std::vector<std::pair<EntityId, EntityId>> metByAvatars;
};

}  // namespace enfilade::scene
