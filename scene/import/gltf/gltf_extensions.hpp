// Which glTF extensions the import reads, which it may leave out, and which it refuses. Private to
// the import.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Throws ImportError for a required extension that is neither read nor without effect on shapes.
/// Returns a diagnostic `ignored_extension` for the optional ones.
std::vector<Diagnostic> checkGltfExtensions(const nlohmann::json& gltf,
                                            const std::filesystem::path& file);

}  // namespace enfilade::scene
