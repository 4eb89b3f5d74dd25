// Computes the axis-aligned bounding box of a placed object.
#pragma once

#include <cstdint>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// World, metres, around all vertices; empty without them.
inline Aabb computeWorldAabb(const Model& model, const Object& object) {
  Aabb box;
  for (const std::uint32_t m : object.meshes) {
    const Mesh& mesh = model.meshes[m];
    for (std::uint32_t i = 0; i < mesh.positions.size(); ++i)
      box.include(computeWorldPosition(object, mesh, i));
  }
  return box;
}

}  // namespace enfilade::scene
