// Finds the height of indoor floors: those with a ceiling, unlike lawns, terraces and roofs.
#pragma once

#include <array>
#include <span>

#include "scene/world/data/scene.hpp"

namespace enfilade::server {

using collision::Vec3;

/// An upward triangle; scene frame, metres.
struct FloorTriangle {
  std::array<Vec3, 3> corners;
  double area = 0;  ///< square metres, projected to the ground

  double height() const { return (corners[0].y() + corners[1].y() + corners[2].y()) / 3; }
};

/// The height with most indoor floor that is less than a storey away from `height`. It is `height`
/// itself if the floor there is mostly indoors, or if no floor near it is.
double findIndoorFloor(const scene::Scene& scene, std::span<const FloorTriangle> faces,
                       double height);

}  // namespace enfilade::server
