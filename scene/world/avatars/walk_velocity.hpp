// Distance, velocity and end of a walk to a waypoint.
#pragma once

#include <algorithm>
#include <cmath>

#include "collision/types.hpp"
#include "scene/world/data/avatar.hpp"
#include "scene/world/data/world_settings.hpp"

namespace enfilade::scene {

using collision::Vec3;

inline constexpr double kArrivalDistance = 1e-3;  ///< metres, horizontal distance to the waypoint
/// metres, vertical distance to the waypoint: excludes another storey
inline constexpr double kArrivalHeight = 1.0;

/// Horizontal distance, metres.
inline double computeGroundDistance(const Vec3& from, const Vec3& to) {
  const double x = to.x() - from.x(), z = to.z() - from.z();
  return std::sqrt(x * x + z * z);
}

inline Vec3 projectToGround(const Vec3& velocity) {
  return {velocity.x(), 0, velocity.z()};
}

/// Velocity towards `goal` for one tick, m/s, with |velocity| <= `speed`; reduced in the last tick
/// to end exactly at the goal. A walk is horizontal, a flight is not.
inline Vec3 computeWalkVelocity(const Vec3& from, const Vec3& goal, bool flying, double speed,
                                double tickDuration) {
  const Vec3 toGoal = goal - from;
  const double distance = flying ? toGoal.norm() : computeGroundDistance(from, goal);
  if (!(distance > 0)) return Vec3::Zero();
  const double reached = std::min(speed, distance / tickDuration);
  return (flying ? toGoal : projectToGround(toGoal)) * (reached / distance);
}

/// True in a fall that is faster than one from a step: it passes a waypoint above the landing.
inline bool isFallingFar(const Avatar& avatar, const WorldSettings& settings) {
  return !avatar.grounded && !avatar.flying && avatar.fallSpeed > 0 &&
         avatar.fallSpeed * avatar.fallSpeed > 2 * settings.gravity * settings.stepHeight;
}

/// Whether an avatar that is at a waypoint, seen from above, has reached it.
inline bool hasReachedHeight(const Vec3& waypoint, const Avatar& avatar,
                             const WorldSettings& settings) {
  return !isFallingFar(avatar, settings) &&
         std::abs(waypoint.y() - avatar.footPosition.y()) <= kArrivalHeight;
}

}  // namespace enfilade::scene
