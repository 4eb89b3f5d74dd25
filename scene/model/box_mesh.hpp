// Corners and triangles of a box.
#pragma once

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// One of eight corners: bit k of `corner` chooses max on axis k.
inline Vec3 computeBoxCorner(const Aabb& box, unsigned corner) {
  return {(corner & 1u) != 0 ? box.max.x() : box.min.x(),
          (corner & 2u) != 0 ? box.max.y() : box.min.y(),
          (corner & 4u) != 0 ? box.max.z() : box.min.z()};
}

/// A closed mesh of a box: eight corners without normals, counter-clockwise seen from outside.
Mesh makeBoxMesh(const Aabb& box);

}  // namespace enfilade::scene
