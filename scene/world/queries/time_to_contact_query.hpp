// Time before which two entities cannot touch, from their exact distance and bounds of their motion
// (Lin 1993, section 5.1; Cohen et al. 1995).
#pragma once

#include "collision/motion/time_to_contact.hpp"
#include "scene/world/data/world_settings.hpp"
#include "scene/world/queries/proximity_query.hpp"

namespace enfilade::scene {

/// Assumption about future motion.
enum class MotionAssumption : std::uint8_t {
  /// Velocities stay as in the last tick, including those of being carried or pushed. Falling
  /// avatars continue to fall; joints move within their limits.
  presentMotion,
  /// Avatars, doors, lifts and paths immediately move as fast as any command allows. Dynamic bodies
  /// are unbounded.
  anyCommand
};

struct TimeToContact {
  PairProximity proximity;
  bool bounded = true;               ///< false: the motion of one has no bound
  collision::ClosingBounds closing;  ///< upper bound of the closing motion; valid if bounded
  double separatedUntil = 0;         ///< seconds; infinity: never
  collision::NextCheck nextCheck;    ///< computed with `minWait`
};

/// Both entities must be present and different. `minWait` >= 0, seconds. Subtracts its cost from
/// `budget`.
std::variant<TimeToContact, QueryError> computeTimeToContact(const SceneAt& sceneAt,
                                                             const WorldSettings& settings,
                                                             EntityId a, EntityId b,
                                                             MotionAssumption assumption,
                                                             double minWait, std::size_t& budget);

}  // namespace enfilade::scene
