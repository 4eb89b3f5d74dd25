// Narrow-phase workload: two convex polytopes in coherent motion.
#pragma once

#include <vector>

#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {

enum class Gap {
  separated,   ///< a gap of the order of the bodies' radius (1 m)
  near,        ///< 1 mm
  penetrating  ///< at most 10 cm deep
};
inline constexpr Gap kGaps[] = {Gap::separated, Gap::near, Gap::penetrating};
const char* nameOf(Gap gap);

struct ConvexMotion {
  Points a, b;
  std::vector<Placement> placesA, placesB;  ///< one for each step
};

/// Vertices on unit spheres; both bodies turn by 0.6 to 1.8 degrees a step about axes of their own
/// while B goes round A. The gap is held at every step by moving B along the closest points.
std::vector<ConvexMotion> convexMotions(std::size_t vertices, Gap gap, std::size_t pairs,
                                        std::size_t steps);

}  // namespace enfilade::benchmarks
