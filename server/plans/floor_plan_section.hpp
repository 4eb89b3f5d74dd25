// What a horizontal cut goes through: the lines of a plan. From above, a wall of single faces is
// seen on edge, and would not be on the plan at all.
#pragma once

#include <vector>

#include "render/camera.hpp"
#include "render/image/image.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::server {

/// Scene frame, metres, at the height of the cut.
struct CutLine {
  collision::Vec3 from, to;
};

/// Where triangles of solid still objects pass through `height` (y). Those that lie in it have no
/// line.
std::vector<CutLine> cutOfStill(const scene::Scene& scene, double height);
/// The same with bodies, as the model has them.
std::vector<CutLine> cutAt(const scene::Scene& scene, double height);

/// On a picture that `camera` took, and whose top left corner stands at (left, top) of `image`.
void drawCut(render::Image& image, const render::Camera& camera, const std::vector<CutLine>& cut,
             double left = 0, double top = 0);

}  // namespace enfilade::server
