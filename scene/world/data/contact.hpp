// Contact: a contact or near miss that persists from tick to tick.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// A persistent contact, or a near miss.
struct Contact {
  EntityId other = 0;
  bool touching = false;  ///< closer than 2 contactOffset; otherwise a reported near miss
  collision::SeparationResult separation;
  double penetration = 0;               ///< metres; the penetration depth or an upper bound of it
  bool nearMissReported = false;        ///< a near miss is active
  collision::SeparationResult closest;  ///< closest approach of the near miss so far
  std::uint64_t closestTick = 0;
};

/// A pair in contact: the reporting entity, and the other.
using EntityPair = std::pair<EntityId, EntityId>;
using BodyContacts = std::vector<std::pair<EntityPair, Contact>>;  ///< ascending pairs

}  // namespace enfilade::scene
