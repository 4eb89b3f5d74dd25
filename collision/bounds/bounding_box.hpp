// Bounding boxes of moving convex bodies (Cohen et al. 1995, section 4): the fixed-size cube, two
// algorithms for the tight box that start from the last tick's extremal vertices, and the rule that
// chooses between cube and tight box.
#pragma once

#include <array>

#include "collision/shapes/hull.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

/// Extremal vertices of the last tick: hull vertex indices for -x, +x, -y, +y, -z, +z.
/// Any indices are valid starting points of the hill climb; good ones make an update O(1).
struct ExtremalVertices {
  std::array<std::uint32_t, 6> vertex{};
};

// All boxes below contain the exact box of the exact pose, inflated by `clearance` (metres, >= 0,
// finite). The exact pose rotates by the quaternion as if it were normalised exactly. The boxes are
// rounded outwards by a proved bound. Poses must be finite, with |rotation| = 1 up to 16 units of
// rounding.

/// Cube around the bounding sphere about the body's origin. Its size does not depend on the pose.
Aabb boundingSphereCube(const Hull& hull, const Pose& worldFromBody, double clearance = 0);

/// Tight box by hill climbing from `last`: for each side, moves to a neighbour vertex while it is
/// more extreme. Replaces `last` by the extremal vertices of this tick.
Aabb tightAabb(const Hull& hull, const Pose& worldFromBody, ExtremalVertices& last,
               double clearance = 0);

/// Tight box by Voronoi regions (Cohen et al. 1995): for each side, tests whether the nearest point
/// of a distant plane lies in the Voronoi region of the last tick's vertex.
Aabb tightAabbVoronoi(const Hull& hull, const Pose& worldFromBody, ExtremalVertices& last,
                      double clearance = 0);

/// Reference implementation of tightAabb(): tests every vertex for every axis.
Aabb tightAabbBruteForce(const Hull& hull, const Pose& worldFromBody, double clearance = 0);

enum class AabbMethod : std::uint8_t { boundingSphereCube, tightAabb };

/// Rough density of the scene. It influences cost only, never a result.
struct SceneDensity {
  double objectsPerCubicMetre = 0.75;  ///< a furnished storey: 68 in a room of 6 m x 5 m x 3 m
  double meanObjectSize = 0.45;        ///< mean edge of the objects' boxes, metres
};

/// Chooses the box that costs less per tick, including the extra narrow-phase queries of a larger
/// box: the cube for small or round bodies, the tight box for oblong or off-centre bodies.
AabbMethod chooseAabbMethod(const Hull& hull, const SceneDensity& density = {});

/// Computes the box by `method`, which is chosen once per body.
inline Aabb computeAabbWith(AabbMethod method, const Hull& hull, const Pose& worldFromBody,
                            ExtremalVertices& last, double clearance = 0) {
  return method == AabbMethod::boundingSphereCube
             ? boundingSphereCube(hull, worldFromBody, clearance)
             : tightAabb(hull, worldFromBody, last, clearance);
}

}  // namespace enfilade::collision
