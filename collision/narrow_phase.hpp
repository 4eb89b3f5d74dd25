// Narrow phase: the verdict on two convex polytopes, and how far apart they are.
#pragma once

#include <limits>
#include <optional>
#include <span>

#include "collision/types.hpp"

namespace enfilade::collision {

enum class Verdict : std::uint8_t { separated, touching, penetrating };
enum class DecidedBy : std::uint8_t {
  filter,   ///< doubles with a proved rounding bound
  rational  ///< exact arithmetic
};

/// What is known of two closed convex bodies A and B. The verdict is exact for the vertices given;
/// the other fields hold as said.
struct Decision {
  Verdict verdict = Verdict::separated;
  DecidedBy decidedBy = DecidedBy::filter;
  double distance = 0;          ///< metres, >= 0; 0 unless separated
  double errorBound = 0;        ///< metres: the true distance lies within distance +- errorBound
  double penetration = 0;       ///< metres: an upper bound of the depth; 0 unless penetrating
  Vec3 pointA = Vec3::Zero();   ///< witness points, world. Separated: closest points.
  Vec3 pointB = Vec3::Zero();   ///< Touching, penetrating: a common point, up to rounding.
  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B; separated only, else the least-overlap axis
};

/// A convex body for one query: the hull of `vertices`, moved by `translation`. Rotations are
/// already applied. At least one vertex, all finite.
struct ConvexBody {
  std::span<const Vec3> vertices;
  Vec3 translation = Vec3::Zero();
};

/// Last tick's answer for the same pair, given back to start from. Any value is right.
struct SeparationCache {
  Vec3 axis = Vec3::Zero();  ///< from A to B, any length; zero: none yet
};

/// The verdict and, when separated, the closest points.
Decision decide(const ConvexBody& a, const ConvexBody& b, SeparationCache& cache);

/// As decide(), but gives up as soon as the distance is proved greater than `limit` (metres):
/// nullopt then.
std::optional<Decision> decideWithin(const ConvexBody& a, const ConvexBody& b, double limit,
                                     SeparationCache& cache);

/// A proved lower bound (metres) of the distance of A and B, by the cached axis alone; negative or
/// minus infinity when the axis proves nothing. Costs two passes over the vertices.
double provedSeparation(const ConvexBody& a, const ConvexBody& b, const SeparationCache& cache);

}  // namespace enfilade::collision
