// What a camera's numbers mean, worked out once in doubles: its axes, and how metres become pixels.
#pragma once

#include <array>

#include "render/camera.hpp"

namespace enfilade::render {

/// A plane a*x + b*y + c*z + d >= 0 that keeps what is seen.
struct Plane {
  Vec3 normal;
  double offset;
};

struct View {
  Vec3 right, up, forward;  ///< unit length, square to one another, world frame
  /// From metres to the picture's -1..1: perspective at distance 1, orthographic anywhere.
  double scaleX, scaleY;
  /// Where in the picture's -1..1 (to the right, upwards) the axis lies; 0 but for pinholes.
  double shiftX, shiftY;
};

/// Of a camera that refusal() lets pass.
View viewOf(const Camera& camera);

/// The four sides, near and far; a point on the inner side of all six may be in the picture.
std::array<Plane, 6> frustumOf(const Camera& camera);

/// False only when the whole box lies outside of one of the planes.
bool mayBeSeen(const std::array<Plane, 6>& frustum, const scene::Box& box);

}  // namespace enfilade::render
