// Narrow phase, level `Decide`: the exact verdict on two convex polytopes, their distance in
// doubles with a proved bound, and witness points. What the tick uses. (Level `Refine`:
// refine.hpp.)
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>

#include "collision/types.hpp"

namespace enfilade::collision {

struct Hull;

/// As closed sets. Touching: they share a point, and an arbitrarily small translation parts them.
enum class Verdict : std::uint8_t { separated, touching, penetrating };
enum class DecidedBy : std::uint8_t {
  filter,     ///< rounded arithmetic with a proved bound
  expansion,  ///< exact sums of doubles
  rational    ///< exact integers of any length
};
/// Part of the surface of a convex body: what a closest point lies within.
enum class Feature : std::uint8_t { none, vertex, edge, face };

/// A convex body for one query: the hull of `vertices` (body's frame, metres; at least one, all
/// finite), placed at rotation * vertex + translation, finite as well: every query throws
/// std::invalid_argument naming what is not. The doubles are taken as they are: where a
/// rotation is orthonormal only to rounding, the body is the very slightly sheared one.
struct ConvexBody {
  std::span<const Vec3> vertices;
  Vec3 translation = Vec3::Zero();
  const Mat3* rotation = nullptr;  ///< worldFromBody; null: none
  const Hull* hull = nullptr;      ///< of exactly these vertices; null: every vertex is looked at
};

/// A vertex of A and a vertex of B: their difference is a point of the Minkowski difference B - A.
struct VertexPair {
  std::uint32_t a = 0, b = 0;
  bool operator==(const VertexPair&) const = default;
};

/// The features that decided the same two bodies last time, given back to start from. Any value
/// is right, a good one makes the query cost O(1).
struct FeatureCache {
  std::array<VertexPair, 4> pairs{};  ///< 1: vertices; 2, 3: their combinations up to two edges or
  int size = 0;                       ///< a vertex and a face; 4: they penetrate; 0: nothing known
  Vec3 axis = Vec3::Zero();           ///< from A to B, any length; zero: none yet
};

/// What is known of two closed convex bodies A and B. The verdict is exact.
struct Decision {
  Verdict verdict = Verdict::separated;
  DecidedBy decidedBy = DecidedBy::filter;
  // The least that pointA and pointB lie within, up to rounding; penetrating: none. Of a body
  // without a hull, two vertices are taken for an edge.
  Feature featureA = Feature::none, featureB = Feature::none;
  double distance = 0;          ///< metres, >= 0; 0 unless separated
  double errorBound = 0;        ///< metres: the true distance lies within distance +- errorBound;
                                ///< at most 16 units of rounding (2^-53) of the largest coordinate
                                ///< after the translations are subtracted
  Vec3 pointA = Vec3::Zero();   ///< world, up to rounding. Separated: closest points of A and B.
  Vec3 pointB = Vec3::Zero();   ///< Touching, penetrating: a common point.
  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B. Separated: along the closest points;
                                ///< touching: of a plane that parts them; penetrating: none (Y)
};

/// The verdict and, when separated, the closest points.
Decision decide(const ConvexBody& a, const ConvexBody& b, FeatureCache& cache);

/// As decide(), but gives up as soon as the distance is proved greater than `limit` (metres):
/// nullopt then.
std::optional<Decision> decideWithin(const ConvexBody& a, const ConvexBody& b, double limit,
                                     FeatureCache& cache);

/// A proved lower bound (metres) of the distance of A and B, by the cached axis alone; negative or
/// minus infinity when the axis proves nothing. Costs two supports.
double provedSeparation(const ConvexBody& a, const ConvexBody& b, const FeatureCache& cache);

}  // namespace enfilade::collision
