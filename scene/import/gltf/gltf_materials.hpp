// Rewrites the materials of a glTF file to the members that assimp and the import read. Private to
// the import.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Whether each texture that the import draws, or that changes what it draws, names an image
/// without an extension.
bool hasPlainTextures(const nlohmann::json& gltf);

/// Replaces KHR_materials_pbrSpecularGlossiness by its diffuse colour and texture, unless the
/// material also states the metallic model. To be called before meshes are rewritten.
void replaceSpecularGlossiness(nlohmann::json& gltf);

/// Gives each texture without a PNG or JPEG image that of EXT_texture_webp, KHR_texture_basisu or
/// EXT_texture_avif. Removes and reports references to drawn textures that have no image. To be
/// called before meshes are rewritten.
void dropMissingTextures(nlohmann::json& gltf, std::vector<Diagnostic>& problems);

/// Removes what is not drawn, and texture mappings, which were applied to the coordinates of
/// primitives.
void simplifyMaterials(nlohmann::json& gltf);

}  // namespace enfilade::scene
