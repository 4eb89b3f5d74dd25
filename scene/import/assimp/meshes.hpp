// Converts the triangles of assimp's meshes.
#pragma once

#include <vector>

#include "scene/model/model.hpp"

struct aiScene;

namespace enfilade::scene {

/// One mesh per assimp mesh; some have no triangles. `gltf`: vertex colours are linear.
/// `join`: vertices that are equal in all respects become one.
std::vector<Mesh> convertMeshes(const aiScene& scene, bool gltf, bool join,
                                std::vector<Diagnostic>& diagnostics);

}  // namespace enfilade::scene
