// Deterministic rotations from angles, by basic arithmetic: libm's sin and cos differ between
// processors.
#pragma once

#include "collision/types.hpp"

namespace enfilade::scene {

/// Unit vector in the ground plane: 0 degrees is +X, 90 is -Z (counter-clockwise seen from above).
/// Finite `degrees` of any size; the result is within 1e-15 of the true direction for |degrees| up
/// to 1e4 and always of unit length within 4 ulp.
collision::Vec3 makeHeadingFromDegrees(double degrees);

/// Rotation by `radians` (finite) about `axis` (unit): whole turns are removed, then as
/// makeHeadingFromDegrees(). A unit quaternion within 4 ulp; exactly the identity for 0.
collision::Quat makeAxisRotation(const collision::Vec3& axis, double radians);

}  // namespace enfilade::scene
