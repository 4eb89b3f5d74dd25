// What the text of a model file says that assimp does not pass on: unit, up axis, who wrote it, and
// whether the file is all there.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "scene/model/model.hpp"

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
  /// That the file says it has, each mesh once; nullopt: not known.
  std::optional<std::size_t> triangles;
  std::vector<Problem> problems;  ///< no_unit, unit_assumed, mended_text
};

/// Reads the file. Throws ImportError when it was cut off or is not what its extension says. Not
/// for IFC, whose text may come out of an archive.
FileFacts readFileFacts(const std::filesystem::path& file, ModelFormat format);

/// The same of the text of an IFC file, for assimp.
FileFacts ifcFileFacts(const std::string& text);

/// A COLLADA file's text as assimp 5.2.5 can read it, where that is another; else empty. What was
/// mended joins `facts.problems`.
std::string mendedCollada(const std::filesystem::path& file, FileFacts& facts);

}  // namespace enfilade::scene
