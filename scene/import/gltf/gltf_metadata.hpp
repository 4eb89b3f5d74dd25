// Counts the triangles that a glTF file declares, before assimp reads it.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>

namespace enfilade::scene {

/// Number of triangles by the accessors of the file's meshes, each mesh counted once. Entries that
/// are invalid count as none: assimp reports them.
std::size_t countGltfTriangles(const nlohmann::json& gltf);
/// As countGltfTriangles(), for the meshes of the default scene alone: assimp reads no others.
std::size_t countSceneTriangles(const nlohmann::json& gltf);

}  // namespace enfilade::scene
