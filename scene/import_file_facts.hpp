// What the text of a model file says that assimp does not pass on: unit, up axis, who wrote it, and
// whether the file is all there.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "scene/model.hpp"

namespace enfilade::scene {

enum class ModelFormat : std::uint8_t { gltf, glb, obj, collada, fbx, ifc };

/// By the extension, in any case; nullopt when it is none that can be imported.
std::optional<ModelFormat> modelFormatOf(const std::filesystem::path& file);

struct FileFacts {
  double metresPerUnit = 1;  ///< what one unit of the file's coordinates means
  char up = 'y';
  /// What assimp multiplies onto the root by itself, to be undone: a scale, and a turn.
  double assimpScale = 1;
  char assimpTurnsUp = 'y';
  std::vector<Problem> problems;  ///< no_unit, unit_assumed, skipped_spaces
};

/// Reads the file. Throws ImportError when it was cut off or is not what its extension says.
FileFacts readFileFacts(const std::filesystem::path& file, ModelFormat format);

}  // namespace enfilade::scene
