// What the JSON of a glTF file says about its meshes, before assimp has them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "scene/import/file_metadata.hpp"

namespace enfilade::scene {

/// How many triangles the meshes have by their accessors, each mesh once; nullopt where the JSON
/// makes no sense, which assimp will tell. Throws ImportError for a file that requires an extension
/// without which its shapes cannot be read.
std::optional<std::size_t> gltfTriangles(const std::filesystem::path& file, ModelFormat format);

}  // namespace enfilade::scene
