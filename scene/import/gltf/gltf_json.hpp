// The JSON of a glTF file.
#pragma once

#include <filesystem>
#include <string>

#include "scene/import/file/model_format.hpp"

namespace enfilade::scene {

/// Levels of nodes that importers follow; more means a broken or malicious file.
inline constexpr int kMaxNodeDepth = 2000;

/// The JSON text of a glTF or GLB file; empty if it cannot be read.
std::string readGltfJson(const std::filesystem::path& file, ModelFormat format);

}  // namespace enfilade::scene
