// Before which time two entities cannot touch: from how far apart they are, exactly, and from
// bounds on how they may move (seed 5.1, collision/continuous.*).
#pragma once

#include "collision/motion/time_to_contact.hpp"
#include "scene/world/data/world_settings.hpp"
#include "scene/world/queries/proximity_query.hpp"

namespace enfilade::scene {

/// What is assumed of the time to come.
enum class Assume : std::uint8_t {
  /// Velocity and spin stay as they were in the last tick, being carried or pushed among it; who
  /// falls falls on; joints do all that they may.
  presentMotion,
  /// Avatars, doors, lifts and things on paths go as fast as they may be told to, at once. Of free
  /// bodies nothing is known.
  anyCommand
};

struct TimeApart {
  PairState now;
  bool bounded = true;               ///< else nothing is known of how they move
  collision::ClosingBounds closing;  ///< how fast they come nearer, at most; when it is bounded
  double contact = 0;                ///< seconds before which they cannot touch; infinity: never
  collision::WakeUp again;           ///< with the least time that is worth waiting
};

/// Of two different entities that are there. `least` >= 0, seconds. Takes what it does from `work`.
std::variant<TimeApart, NoAnswer> timeApart(const SceneThen& then, const Lengths& lengths,
                                            EntityId a, EntityId b, Assume assume, double least,
                                            std::size_t& work);

}  // namespace enfilade::scene
