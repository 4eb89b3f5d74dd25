// Certifies with exact sums of doubles that two convex bodies touch. Internal to the narrow phase.
#pragma once

#include "collision/minkowski/minkowski.hpp"

namespace enfilade::collision {

/// True: certified that no point of B - A has a negative projection on `direction` and that the
/// origin is in B - A. The bodies then share surface points only. False: nothing is certified.
/// `hint`: the start vertices of the hill climbs. Succeeds only if the relevant coordinates are
/// exact: poses without rotation, or rotated about `direction`, as for bodies on floors and against
/// walls.
bool certifyTouching(const MinkowskiDifference& difference, const Vec3& direction, VertexPair hint);

}  // namespace enfilade::collision
