// The JSON of a glTF file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "scene/import/file/model_format.hpp"

namespace enfilade::scene {

/// Levels of nodes that importers follow; more means a broken or malicious file.
inline constexpr int kMaxNodeDepth = 2000;

inline constexpr std::size_t kNoIndex = ~std::size_t{0};  ///< in place of a member that is missing

/// The JSON text of a glTF or GLB file; empty if it cannot be read.
std::string readGltfJson(const std::filesystem::path& file, ModelFormat format);

}  // namespace enfilade::scene
