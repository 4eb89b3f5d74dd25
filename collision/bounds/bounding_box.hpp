// Boxes of moving convex bodies (seed 5.2.1): the fixed cube, two ways to the tight box from
// extremal vertices that are kept from the last tick, and the rule that chooses between cube and
// tight box.
#pragma once

#include <array>

#include "collision/shapes/hull.hpp"
#include "collision/types.hpp"

namespace enfilade::collision {

/// Last tick's extremal vertices: for -x, +x, -y, +y, -z, +z the index of a vertex of the hull.
/// Any indices are right (climbing goes on from there); good ones make the update cost O(1).
struct ExtremalVertices {
  std::array<std::uint32_t, 6> vertex{};
};

// All of these boxes contain every point within `clearance` (metres, >= 0, finite) along each axis
// of the exact box of the exact pose, that is, of the hull turned by the quaternion as if it were
// normalised exactly: they are rounded outwards by a proved bound. Poses are finite, |rotation| is
// 1 but for rounding (16 units of it).

/// The box of the sphere of the body about its origin: only its centre moves.
Box fixedCube(const Hull& hull, const Pose& worldFromBody, double clearance = 0);

/// The tight box: climbs from last tick's extremal vertices to a neighbour while that neighbour's
/// one coordinate is more extreme. `last` is replaced by this tick's extremal vertices.
Box tightBox(const Hull& hull, const Pose& worldFromBody, ExtremalVertices& last,
             double clearance = 0);

/// The same box by the seed's other method: six imaginary walls about the body, and for each the
/// half of the vertex-face test that asks whether the wall's nearest point lies in the Voronoi
/// region of last tick's vertex.
Box tightBoxByWalls(const Hull& hull, const Pose& worldFromBody, ExtremalVertices& last,
                    double clearance = 0);

/// The slow twin of tightBox(): every vertex, every axis.
Box tightBoxBruteForce(const Hull& hull, const Pose& worldFromBody, double clearance = 0);

enum class BoxMethod : std::uint8_t { fixedCube, tightBox };

/// What a body moves among, roughly: it steers cost, never an answer.
struct Surroundings {
  double objectsPerCubicMetre = 0.75;  ///< a furnished storey: 68 in a room of 6 m x 5 m x 3 m
  double meanEdge = 0.45;              ///< of the boxes of these objects, metres
};

/// Which box costs less over a tick, with the narrow-phase queries that a larger box asks for: the
/// cube for what is small or round, the tight box for what is oblong or far from its own origin.
BoxMethod boxMethodFor(const Hull& hull, const Surroundings& surroundings = {});

/// The box by that method, chosen once a body.
inline Box boxBy(BoxMethod method, const Hull& hull, const Pose& worldFromBody,
                 ExtremalVertices& last, double clearance = 0) {
  return method == BoxMethod::fixedCube ? fixedCube(hull, worldFromBody, clearance)
                                        : tightBox(hull, worldFromBody, last, clearance);
}

}  // namespace enfilade::collision
