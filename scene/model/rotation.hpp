// Directions from angles, by arithmetic alone: libm's sin and cos differ between processors.
#pragma once

#include "collision/types.hpp"

namespace enfilade::scene {

/// Unit vector in the ground plane: 0 degrees is +X, 90 is -Z (counter-clockwise seen from above).
/// Finite `degrees` of any size; the result is within 1e-15 of the true direction for |degrees| up
/// to 1e4 and always of unit length within 4 ulp.
collision::Vec3 headingFromDegrees(double degrees);

/// The rotation about `axis` (unit) by `radians`, finite: by whole turns, then as
/// headingFromDegrees(). A unit quaternion within 4 ulp; the identity to the last bit for 0.
collision::Quat rotationAbout(const collision::Vec3& axis, double radians);

}  // namespace enfilade::scene
