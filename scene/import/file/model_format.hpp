// ModelFormat: the formats of model files. FileMetadata: unit, up axis and scenes that a file
// states.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

enum class ModelFormat : std::uint8_t { gltf, glb, obj, collada, fbx, ifc, ply, stl };

/// Detects the format by the extension, in any case; nullopt for an unknown one.
std::optional<ModelFormat> detectModelFormat(const std::filesystem::path& file);

/// Returns the extensions that importModel() accepts, lower case, with the dot.
std::span<const std::string_view> listImportableExtensions();

/// Statements of a model file about its coordinates.
struct FileMetadata {
  double metresPerUnit = 1;  ///< metres per unit of the file's coordinates
  UpAxis up = UpAxis::y;
  /// Scale and up axis that assimp applies to the root by itself. The import undoes both.
  double assimpScale = 1;
  UpAxis assimpUp = UpAxis::y;
  /// Triangles that the file declares, each mesh once; nullopt: unknown.
  std::optional<std::size_t> triangles;
  std::vector<std::string> scenes;  ///< glTF: names; see Model::fileScenes
  std::uint32_t scene = 0;
  std::vector<Diagnostic> problems;  ///< no_unit, unit_assumed, mended_text
};

}  // namespace enfilade::scene
