// Decides whether assimp reads a glTF file right, or whether the pre-pass must rewrite it. Private
// to the import.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "scene/import/file/model_format.hpp"

namespace enfilade::scene {

/// `text`: the file's JSON; `sections`: its meshes, accessors, views, buffers, materials and
/// textures, parsed. True also if data lies outside its buffer: assimp would read other bytes.
bool needsRewriting(const std::string& text, const nlohmann::json& sections,
                    const std::filesystem::path& file, ModelFormat format);

/// Whether the pre-pass reads this extension, so that a rewritten file no longer uses it.
bool isRewrittenExtension(const std::string& name);

}  // namespace enfilade::scene
