// The slow twin of the verdict: the textbook's definitions in rationals, no filter, no features.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision::testing {

/// Exact for the given doubles; bodies without a rotation. Costs milliseconds.
Verdict rationalVerdict(const ConvexBody& a, const ConvexBody& b);

}  // namespace enfilade::collision::testing
