// The verdict on two convex polytopes by rational arithmetic: slow, and right for every input.
#pragma once

#include "collision/narrow_phase.hpp"

namespace enfilade::collision {

/// Exact for the given doubles. Costs milliseconds; narrow_phase.cpp calls it only where its filter
/// cannot decide.
Verdict exactVerdict(const ConvexBody& a, const ConvexBody& b);

}  // namespace enfilade::collision
