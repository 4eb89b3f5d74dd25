// Reads mesh metadata from the JSON of a glTF file, before assimp reads the file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "scene/import/file/model_format.hpp"

namespace enfilade::scene {

/// Number of triangles by the accessors, each mesh counted once; nullopt for invalid JSON, which
/// assimp will report. Throws ImportError if the file requires an unsupported extension.
std::optional<std::size_t> countGltfTriangles(const std::filesystem::path& file,
                                              ModelFormat format);

}  // namespace enfilade::scene
