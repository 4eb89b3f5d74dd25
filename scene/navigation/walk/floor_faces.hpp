// FloorFace: a level upper face of an obstacle. Floor faces show how far a walk stays above even
// floor, so that one step of the proof can be long.
#pragma once

#include <vector>

#include "scene/world/data/obstacle.hpp"

namespace enfilade::scene {

struct FloorFace {
  double y = 0;               ///< metres, scene frame
  std::vector<Vec3> corners;  ///< counter-clockwise seen from above
  Aabb box;
};

/// The level faces of `obstacles` that overlap `box`.
std::vector<FloorFace> collectFloorFaces(const ObstacleSet& obstacles, const Aabb& box);

/// Returns how far, at most `length` metres, the point below the feet can move along the horizontal
/// unit vector `direction`. It moves on faces of the height that it has at `footPosition`.
double computeEvenDistance(const std::vector<FloorFace>& faces, const Vec3& footPosition,
                           const Vec3& direction, double length);

}  // namespace enfilade::scene
