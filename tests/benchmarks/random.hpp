// Seeded random numbers for the workloads.
#pragma once

#include <random>

#include "collision/types.hpp"

namespace enfilade::benchmarks {

using collision::Vec3;
using Random = std::mt19937_64;

inline double drawUniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// A uniformly distributed unit vector.
inline Vec3 drawDirection(Random& random) {
  while (true) {
    const double x = drawUniform(random, -1, 1);
    const double y = drawUniform(random, -1, 1);
    const double z = drawUniform(random, -1, 1);
    const Vec3 v(x, y, z);
    if (v.squaredNorm() > 0.01 && v.squaredNorm() < 1) return v.normalized();
  }
}

}  // namespace enfilade::benchmarks
