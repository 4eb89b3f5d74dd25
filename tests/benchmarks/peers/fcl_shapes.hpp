// Shapes and poses as FCL takes them.
#pragma once

#include <fcl/geometry/shape/convex.h>

#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {

inline std::unique_ptr<fcl::Convexd> makeFclConvex(const Points& points) {
  const collision::Hull hull = collision::buildHull(points);
  auto vertices = std::make_shared<const std::vector<Vec3>>(hull.vertices);
  auto faces = std::make_shared<std::vector<int>>();
  for (const auto& face : hull.faces) {
    faces->push_back(static_cast<int>(face.size()));
    for (const std::uint32_t vertex : face) faces->push_back(static_cast<int>(vertex));
  }
  return std::make_unique<fcl::Convexd>(vertices, static_cast<int>(hull.faces.size()), faces);
}

inline fcl::Transform3d toFcl(const RigidTransform& at) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.linear() = at.rotation;
  transform.translation() = at.translation;
  return transform;
}

}  // namespace enfilade::benchmarks
