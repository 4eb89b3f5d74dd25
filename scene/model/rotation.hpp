// Converts angles to heading vectors, with the same bits on every machine.
#pragma once

#include "collision/sine_cosine.hpp"

namespace enfilade::scene {

/// Unit vector in the ground plane: 0 degrees is +X, 90 is -Z (counter-clockwise seen from above).
/// `degrees` is finite and of any size. The result is within 1e-15 of the true direction for
/// |degrees| up to 1e4 and always of unit length within 4 ulp.
inline collision::Vec3 makeHeadingFromDegrees(double degrees) {
  const auto [s, c] = collision::computeSineCosineOfDegrees(degrees);
  return {c, 0, -s};
}

using collision::makeAxisRotation;

}  // namespace enfilade::scene
