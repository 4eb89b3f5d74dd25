// Counts the triangles that a glTF file declares, before assimp reads it.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <vector>

namespace enfilade::scene {

/// Number of triangles of each mesh by its accessors. Entries that are invalid count as none:
/// assimp reports them.
std::vector<std::size_t> countTrianglesByMesh(const nlohmann::json& gltf);

}  // namespace enfilade::scene
