// That two convex bodies touch, proved with exact sums of doubles. Internal to the narrow phase.
#pragma once

#include "collision/minkowski/minkowski.hpp"

namespace enfilade::collision {

/// True: proved that no point of B - A is negative along `direction` and that the origin is one of
/// them, so that the bodies share a point and no more than their surfaces. False says nothing. Can
/// only succeed where the coordinates that matter come out exact: poses without rotation, or turned
/// about an axis that the direction lies along, as things stand on floors and against walls.
bool provedTouching(const MinkowskiDifference& difference, const Vec3& direction, VertexPair hint);

}  // namespace enfilade::collision
