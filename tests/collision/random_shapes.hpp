// Seeded shapes for the tests of the narrow phase.
#pragma once

#include <random>
#include <vector>

#include "collision/shapes/hull.hpp"
#include "collision/shapes/triangle_tree.hpp"

namespace enfilade::collision::testing {

using Random = std::mt19937_64;

inline const std::vector<Vec3> kUnitCube{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                                         {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};

/// Uniform in [low, high); written out because std's distributions differ between libraries.
inline double drawUniform(Random& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
}

inline Vec3 makeRandomPoint(Random& random, double size) {
  const double x = drawUniform(random, -size, size);
  const double y = drawUniform(random, -size, size);
  const double z = drawUniform(random, -size, size);
  return {x, y, z};
}

inline std::vector<Vec3> makeRandomPoints(Random& random, int count, double size) {
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) points.push_back(makeRandomPoint(random, size));
  return points;
}

/// Points on a small integer lattice, so that touching, flat and equal shapes are frequent.
inline std::vector<Vec3> makeLatticePoints(Random& random, int count, int size) {
  const auto coordinate = [&] {
    return static_cast<double>(static_cast<int>(random() % (2 * size + 1)) - size);
  };
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) {
    const double x = coordinate();
    const double y = coordinate();
    const double z = coordinate();
    points.emplace_back(x, y, z);
  }
  return points;
}

/// The boundary of a hull as triangles (fans of its faces), at `translation`.
inline std::vector<Triangle> makeBoundary(const Hull& hull, const Vec3& translation) {
  std::vector<Triangle> triangles;
  for (const auto& face : hull.faces)
    for (std::size_t i = 2; i < face.size(); ++i)
      triangles.push_back({hull.vertices[face[0]] + translation,
                           hull.vertices[face[i - 1]] + translation,
                           hull.vertices[face[i]] + translation});
  return triangles;
}

}  // namespace enfilade::collision::testing
