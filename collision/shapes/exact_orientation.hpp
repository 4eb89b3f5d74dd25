// Exact predicates on points given in doubles: a filter with a proved bound first, integers last.
#pragma once

#include "collision/types.hpp"

namespace enfilade::collision {

/// The side of the plane through a, b, c on which d lies: +1 where (b - a) x (c - a) points,
/// -1 opposite, 0 on the plane. Exact for all finite coordinates.
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// The turn a, b, c with the coordinate `dropped` (0..2) left out: +1 when it runs anticlockwise in
/// the plane of the next two coordinates in cyclic order (dropped 0: y, z). Exact.
int turn(const Vec3& a, const Vec3& b, const Vec3& c, int dropped);

/// True when the three points lie on one line. Exact.
bool collinear(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace enfilade::collision
