// Converts the triangles of assimp's meshes.
#pragma once

#include <vector>

#include "scene/model/model.hpp"

struct aiScene;

namespace enfilade::scene {

/// One mesh per assimp mesh; some have no triangles.
std::vector<Mesh> convertMeshes(const aiScene& scene, std::vector<Diagnostic>& diagnostics);

}  // namespace enfilade::scene
