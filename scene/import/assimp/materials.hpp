// Converts the materials and textures of assimp's scene.
#pragma once

#include <filesystem>
#include <vector>

#include "scene/import/assimp/assimp_reader.hpp"
#include "scene/import/file/import_options.hpp"
#include "scene/import/file/model_format.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Appends the materials in their order and decodes their textures, which lie near `file`; `scene`
/// may embed some.
void convertMaterials(const aiScene& scene, const std::vector<FileMaterial>& materials,
                      const std::filesystem::path& file, ModelFormat format, Model& model,
                      const ImportProgress& progress);

}  // namespace enfilade::scene
