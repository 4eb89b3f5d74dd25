// Derived camera data in doubles: axes, projection scale and frustum planes.
#pragma once

#include <array>

#include "render/camera.hpp"

namespace enfilade::render {

/// A plane; points p with normal.dot(p) + offset >= 0 are inside.
struct Plane {
  Vec3 normal;
  double offset;
};

/// A camera's axes and its mapping from metres to normalised device coordinates (NDC, -1..1).
struct CameraBasis {
  Vec3 right, up, forward;  ///< orthonormal, world frame
  /// From metres to NDC; perspective: at distance 1.
  double scaleX, scaleY;
  /// NDC (right, up) of the principal point; 0 except for pinholes.
  double shiftX, shiftY;
};

/// `camera` must satisfy validateCamera().
CameraBasis computeCameraBasis(const Camera& camera);

/// The four sides, near and far. A point inside all six planes may be in the image.
std::array<Plane, 6> computeFrustum(const Camera& camera);

}  // namespace enfilade::render
