// Narrow-phase workload: two convex polytopes in coherent motion.
#pragma once

#include <vector>

#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {

enum class Gap {
  separated,   ///< a gap of about the bodies' radius (1 m)
  near,        ///< 1 mm
  penetrating  ///< at most 10 cm deep
};
inline constexpr Gap kGaps[] = {Gap::separated, Gap::near, Gap::penetrating};
const char* getName(Gap gap);

struct ConvexMotion {
  Points a, b;
  std::vector<RigidTransform> placesA, placesB;  ///< one for each step
};

/// Polytopes with vertices on unit spheres. Both rotate by 0.6 to 1.8 degrees a step about their
/// own axes while B orbits A. Each step moves B along the closest points to restore the gap.
std::vector<ConvexMotion> makeConvexMotions(std::size_t vertices, Gap gap, std::size_t pairs,
                                            std::size_t steps);

}  // namespace enfilade::benchmarks
