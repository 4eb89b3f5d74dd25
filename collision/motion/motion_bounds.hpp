// Bounds of how long a separating plane separates moving bodies, shared by all motions.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "collision/types.hpp"

namespace enfilade::collision {

/// Smallest s > 0 with gap - closing s - curvature s^2 / 2 = 0; infinity if there is no such s.
/// gap, curvature >= 0.
inline double findFirstRoot(double gap, double closing, double curvature) {
  if (curvature == 0) return closing > 0 ? gap / closing : std::numeric_limits<double>::infinity();
  const double root = std::sqrt(closing * closing + 2 * curvature * gap);
  return closing > 0 ? 2 * gap / (closing + root) : (root - closing) / curvature;
}

/// Lower bound of the s at which a vertex reaches the plane that lies `gap` metres beyond the
/// foremost vertex. `path` bounds the motion of a vertex along the plane's normal. With
/// r = path.arm(vertex), the vertex starts at path.height(r) and advances in s by at most
/// path.speed(r) s + path.curvature(r) s^2 / 2.
template <class Path>
double findPlaneCrossing(std::span<const Vec3> vertices, double gap, const Path& path) {
  double foremost = -std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : vertices) foremost = std::max(foremost, path.height(path.arm(vertex)));
  double first = std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : vertices) {
    const Vec3 r = path.arm(vertex);
    const double behind = gap + (foremost - path.height(r));
    first = std::min(first, findFirstRoot(behind, path.speed(r), path.curvature(r)));
  }
  return first;
}

}  // namespace enfilade::collision
