// Reference implementation of the verdict: textbook definitions in rationals, no filter, no
// features.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision::testing {

/// Exact for the given doubles; bodies without a rotation. Costs milliseconds.
Verdict computeRationalVerdict(const PlacedConvex& a, const PlacedConvex& b);

}  // namespace enfilade::collision::testing
