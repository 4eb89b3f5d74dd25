// Exact orientation predicates on points in doubles: a floating-point filter with a proved bound,
// then exact integer arithmetic.
#pragma once

#include "collision/types.hpp"

namespace enfilade::collision {

/// Side of the plane through a, b, c on which d lies. It is +1 in the direction of
/// (b - a) x (c - a), -1 opposite, 0 on the plane. Exact for all finite coordinates.
int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Orientation of a, b, c after projection along the coordinate `dropped` (0..2). It is +1 if they
/// run anticlockwise in the plane of the next two coordinates in cyclic order (dropped 0: y, z). It
/// is 0 if they are collinear there. Exact.
int orient2d(const Vec3& a, const Vec3& b, const Vec3& c, int dropped);

/// True if the three points lie on one line. Exact.
bool areCollinear(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace enfilade::collision
