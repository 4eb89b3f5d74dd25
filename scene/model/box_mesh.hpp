#pragma once

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// A closed mesh of a box: eight corners without normals, counter-clockwise seen from outside.
Mesh makeBoxMesh(const Aabb& box);

}  // namespace enfilade::scene
