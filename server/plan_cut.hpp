// What a horizontal cut goes through: the lines of a plan. From above, a wall of single faces is
// seen on edge, and would not be on the plan at all.
#pragma once

#include <vector>

#include "scene/scene.hpp"

namespace enfilade::server {

/// Scene frame, metres, at the height of the cut.
struct CutLine {
  collision::Vec3 from, to;
};

/// Where triangles of solid objects, and of bodies as the model has them, pass through `height`
/// (y). Those that lie in it have no line.
std::vector<CutLine> cutAt(const scene::Scene& scene, double height);

}  // namespace enfilade::server
