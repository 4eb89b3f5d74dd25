// Reads a file with assimp, which is loaded as a module (reader_module.hpp). Runs only in the
// import worker. The scene is plain data of assimp; the module copies the materials, because
// assimp offers them only through functions.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

struct aiScene;

namespace enfilade::scene {

/// One material as the file states it; absent values are empty. Colours are RGBA: linear for glTF,
/// sRGB for all other formats.
struct FileMaterial {
  std::string name;
  std::optional<Eigen::Vector4f> baseColour;  ///< the diffuse colour if there is no base colour
  Eigen::Vector3f emissive = Eigen::Vector3f::Zero();
  std::optional<float> metallic, roughness, opacity, alphaCutoff;
  std::optional<bool> doubleSided;
  std::string alphaMode;          ///< glTF's alphaMode
  std::string baseColourTexture;  ///< the diffuse texture if there is no base colour texture
  bool emissiveTexture = false;
};

/// A file for assimp.
struct AssimpInput {
  std::string file;
  std::string text;                       ///< replaces the file's contents, if it is not empty
  std::size_t restAt = 0, restBytes = 0;  ///< bytes of the file that follow the text
  bool isIfc = false;                     ///< true: assimp reads only `text`
};

/// The result of reading a file with assimp.
struct AssimpOutput {
  const aiScene* scene = nullptr;  ///< lives as long as the process; null: see `failure`
  /// Equal vertices are one. False if any mesh has vertex colours, which assimp would ignore.
  bool joined = true;
  std::vector<FileMaterial> materials;    ///< in assimp's order
  std::vector<std::string> dependencies;  ///< files that assimp opened or looked for
  std::string failure;
  std::string library;  ///< path of assimp's shared library
};

std::filesystem::path findAssimpModule();

/// Sends progress messages meanwhile. Throws ImportError if the module cannot be opened.
AssimpOutput readWithAssimp(const AssimpInput& file);

/// The module's exported function; its symbol is kAssimpReadSymbol. Increase the number in the
/// symbol whenever this signature, its structs or the progress message changes.
using AssimpReadFunction = void(const AssimpInput& file, AssimpOutput& read);
inline constexpr const char* kAssimpReadSymbol = "enfiladeReadByAssimp3";

}  // namespace enfilade::scene
