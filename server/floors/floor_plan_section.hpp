// Horizontal sections of a scene: the outlines of a floor plan.
#pragma once

#include <vector>

#include "scene/world/data/scene.hpp"

namespace enfilade::server {

using collision::Vec3;

/// The section of one object: scene frame, metres, at the height of the cut.
struct ObjectSection {
  std::uint32_t object = 0;
  scene::Aabb box;                       ///< of the whole object
  std::vector<std::vector<Vec3>> loops;  ///< closed outlines, those of scans over small holes
  std::vector<std::vector<Vec3>> lines;  ///< of open surfaces

  bool empty() const { return loops.empty() && lines.empty(); }
};

/// Sections of solid static objects at `height` (y). Triangles inside the plane have no line.
std::vector<ObjectSection> cutStatic(const scene::Scene& scene, double height);

/// The section of one object, as the model places it.
ObjectSection cutObject(const scene::Model& model, std::uint32_t object, double height);

}  // namespace enfilade::server
