// Cheap proved lower bounds of the distance of a placed body to boxes and triangles. Internal to
// mesh_query.cpp.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/triangle_tree.hpp"

namespace enfilade::collision {

/// Bounds of a body in the frame of the mesh tree: world axes, origin of the tree, metres.
struct QueryBounds {
  Eigen::ArrayX3d vertices;  ///< of the body, one per row, rounded
  Aabb box;
  Vec3 centre = Vec3::Zero();
  double radius = 0;         ///< of a sphere around `centre` that contains the body
  Vec3 axis = Vec3::Zero();  ///< unit or zero
  double support = 0;        ///< maximum projection of the body on `axis`
  double pad = 0;            ///< metres: more than the rounding error of any bound below
};

/// Computes the bounds. `bodyRadius`: of the body about its own origin, metres. `axis`: direction
/// of the last closest points, any length.
void computeQueryBounds(const PlacedConvex& body, double bodyRadius, const BoxTree& tree,
                        const Vec3& axis, QueryBounds& bounds);

/// Lower bounds of the distance, metres; negative if no separation is proved.
double computeLowerBound(const QueryBounds& bounds, const FloatAabb& box);
double computeLowerBound(const QueryBounds& bounds, const Triangle& inTree);

/// Lower bound from the projections on one axis of any nonzero length.
double computeLowerBoundAlong(const QueryBounds& bounds, const Vec3& axis, const Triangle& inTree);

}  // namespace enfilade::collision
