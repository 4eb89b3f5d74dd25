// Fisheye distortion: OpenCV's model.
#pragma once

#include <array>

namespace enfilade::render {

/// Distance from the centre, in focal lengths, of a direction at `angle` (radians).
inline double distort(const std::array<double, 4>& k, double angle) {
  const double square = angle * angle;
  return angle * (1 + square * (k[0] + square * (k[1] + square * (k[2] + square * k[3]))));
}

}  // namespace enfilade::render
