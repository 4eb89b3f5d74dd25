// Passengers of a kinematic body in a tick are dynamic bodies that rest on it and avatars that
// stand on it or on those. Avatars near any of them may obstruct the motion and are passengers too.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// A dynamic body that rests on the carrier, directly or on another carried body. It is assumed to
/// rise straight up with its centre; the solver resolves tilting and obstruction.
struct CarriedBody {
  std::uint32_t index;                      ///< into WorldData::bodies
  Vec3 centre;                              ///< in the carrier's frame
  double initialHeight;                     ///< of the centre, at the start of the tick
  double externalLift;                      ///< metres, by other kinematic bodies in this tick
  double lift = 0;                          ///< metres, by the carrier so far
  double remainingLift = 0;                 ///< metres, on the current motion
  std::vector<Avatar*> nearbyAvatars = {};  ///< avatars that it may hit

  /// Lift that is already applied; the current motion may end below it.
  double appliedLift() const { return std::max(lift, externalLift); }
  bool isLifted() const { return lift + remainingLift > appliedLift(); }
};

struct CarriedAvatar {
  Avatar* avatar;
  Vec3 contact;              ///< on the carrier, in its frame
  bool onCarriedBody;        ///< stands on a carried body, not on the carrier itself
  bool fullyLifted = false;  ///< for the whole current motion: no carried body gets closer
};

/// Passengers of a kinematic body in this tick, and the avatars that may obstruct it.
struct Passengers {
  std::vector<CarriedBody> bodies;  ///< those with an avatar nearby
  std::vector<Avatar*> nearbyAvatars;
  std::vector<CarriedAvatar> avatars;
};

/// Pairs (lower body, dynamic body that stands on it), ascending.
using SupportGraph = std::vector<std::pair<EntityId, EntityId>>;

/// Built from the contacts of the last tick. Empty if no avatar or moving kinematic body exists.
SupportGraph buildSupportGraph(const WorldData& world);

Passengers findPassengers(WorldData& world, const Body& body, const SupportGraph& supportGraph);

}  // namespace enfilade::scene
