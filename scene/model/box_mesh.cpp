#include "scene/model/box_mesh.hpp"

namespace enfilade::scene {

Mesh makeBoxMesh(const Aabb& box) {
  Mesh mesh;
  for (unsigned i = 0; i < 8; ++i) mesh.positions.push_back(computeBoxCorner(box, i).cast<float>());
  mesh.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  return mesh;
}

}  // namespace enfilade::scene
