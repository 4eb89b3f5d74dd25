// Horizontal sections of a scene: the lines of a floor plan. Without them, walls of single faces
// would be invisible from above.
#pragma once

#include <vector>

#include "render/camera.hpp"
#include "render/image/image.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::server {

/// A line of a section: scene frame, metres, at the height of the cut.
struct SectionLine {
  collision::Vec3 from, to;
};

/// Section of solid static objects at `height` (y). Triangles inside the plane have no line.
std::vector<SectionLine> cutStatic(const scene::Scene& scene, double height);
/// The same, including bodies in their initial poses.
std::vector<SectionLine> cutScene(const scene::Scene& scene, double height);

/// Draws a section onto a picture of `camera` whose top left corner is at (left, top) of `image`.
void drawSection(render::Image& image, const render::Camera& camera,
                 const std::vector<SectionLine>& section, double left = 0, double top = 0);

}  // namespace enfilade::server
