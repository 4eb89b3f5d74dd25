// Integrals of 1, x and x x^T over a solid are sums over its triangles (Mirtich, "Fast and Accurate
// Computation of Polyhedral Mass Properties", 1996). Each triangle spans a tetrahedron with a point
// near the solid. For corners 0, p, q, r and D = det(p, q, r):
//   volume D / 6,  first moment D / 24 s,  second D / 120 (p p^T + q q^T + r r^T + s s^T),
// s = p + q + r. These are exact polynomials, so the only error is rounding. The point is the
// centre of the AABB, so that a body far from its frame's origin loses no digits.
#include "scene/model/shapes/mass_properties.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "collision/shapes/triangle_tree.hpp"

namespace enfilade::scene {
namespace {

/// Volumes below this fraction of the AABB's cube are rounding errors, not solids.
constexpr double kMinRelativeVolume = 0x1p-40;

struct Integrals {
  double volume = 0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();
};

Mat3 computeOuterProduct(const Vec3& v) {
  return v * v.transpose();
}

/// sum of m (|x|^2 1 - x x^T) from the sum of m x x^T.
Mat3 computeInertia(const Mat3& second) {
  return second.trace() * Mat3::Identity() - second;
}

Integrals integrate(std::span<const collision::Triangle> triangles, const Vec3& origin) {
  Integrals sum;
  for (const collision::Triangle& t : triangles) {
    const Vec3 p = t[0] - origin, q = t[1] - origin, r = t[2] - origin, s = p + q + r;
    const double determinant = p.dot(q.cross(r));
    sum.volume += determinant / 6;
    sum.first += determinant / 24 * s;
    sum.second += determinant / 120 *
                  (computeOuterProduct(p) + computeOuterProduct(q) + computeOuterProduct(r) +
                   computeOuterProduct(s));
  }
  return sum;
}

void requirePositive(double value, const char* what) {
  if (!(value > 0) || !std::isfinite(value))
    throw std::invalid_argument(std::string(what) + " is " + std::to_string(value) +
                                ": it must be above 0 and finite");
}

/// Requires triangles that are counter-clockwise seen from outside.
MassProperties computeMeshMass(std::span<const collision::Triangle> triangles, double density) {
  requirePositive(density, "density");
  collision::Aabb box;
  for (const collision::Triangle& t : triangles) box.include(collision::computeAabb(t));
  if (box.empty()) throw std::invalid_argument("a body without triangles has no mass");
  const Vec3 origin = box.centre();
  const Integrals sum = integrate(triangles, origin);
  const double size = box.size().maxCoeff();
  if (!(sum.volume > kMinRelativeVolume * size * size * size))
    throw std::invalid_argument(
        "a body that is flat, open or inside out has no mass: close its mesh, turn its faces "
        "outwards, or give its hull");
  MassProperties result;
  result.volume = sum.volume;
  result.mass = density * sum.volume;
  const Vec3 centre = sum.first / sum.volume;
  result.centre = origin + centre;
  result.inertia = density * computeInertia(sum.second - sum.volume * computeOuterProduct(centre));
  return result;
}

}  // namespace

MassProperties computeHullMass(const collision::Hull& hull, double density) {
  std::vector<collision::Triangle> triangles;
  for (const auto& face : hull.faces)
    for (std::size_t i = 1; i + 1 < face.size(); ++i)
      triangles.push_back(
          {hull.vertices[face[0]], hull.vertices[face[i]], hull.vertices[face[i + 1]]});
  return computeMeshMass(triangles, density);
}

MassProperties combineMassProperties(std::span<const MassProperties> parts) {
  if (parts.empty()) throw std::invalid_argument("a body without parts has no mass");
  MassProperties sum;
  for (const MassProperties& part : parts) {
    sum.volume += part.volume;
    sum.mass += part.mass;
    sum.centre += part.mass * part.centre;
  }
  sum.centre /= sum.mass;
  for (const MassProperties& part : parts)
    sum.inertia +=
        part.inertia + part.mass * computeInertia(computeOuterProduct(part.centre - sum.centre));
  return sum;
}

MassProperties scaleToMass(MassProperties properties, double mass) {
  requirePositive(mass, "mass");
  properties.inertia *= mass / properties.mass;
  properties.mass = mass;
  return properties;
}

}  // namespace enfilade::scene
