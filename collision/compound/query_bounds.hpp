// A placed body as the mesh search sees it: cheap proved lower bounds of its distance to boxes and
// triangles. Internal to mesh_query.cpp.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/triangle_tree.hpp"

namespace enfilade::collision {

/// In the frame of the mesh's tree: world axes, the tree's origin.
struct MeshProbe {
  Eigen::ArrayX3d vertices;  ///< of the body, one a row, rounded
  Box box;
  Vec3 centre = Vec3::Zero();
  double radius = 0;         ///< of a ball around `centre` that holds the body
  Vec3 axis = Vec3::Zero();  ///< unit or zero; the body lies below `support` along it
  double support = 0;
  double pad = 0;  ///< metres: more than what rounding adds to any bound below
};

/// `bodyRadius`: of the body about its own origin. `axis`: of the last closest points, any length.
void placeProbe(const ConvexBody& body, double bodyRadius, const BoxTree& tree, const Vec3& axis,
                MeshProbe& probe);

/// Lower bounds of the distance, metres; negative where nothing is proved.
double lowerBound(const MeshProbe& probe, const NarrowBox& box);
double lowerBound(const MeshProbe& probe, const Triangle& inTree);

/// By the slab along one axis of any length but zero.
double lowerBoundAlong(const MeshProbe& probe, const Vec3& axis, const Triangle& inTree);

}  // namespace enfilade::collision
