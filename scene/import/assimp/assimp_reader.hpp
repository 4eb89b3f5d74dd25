// Reads a file with assimp, which stands behind a module: reader_module.hpp. Runs in the import
// child only. What assimp made of the file is plain data; what it says of materials, it has
// functions for, so that the module asks them.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

struct aiScene;

namespace enfilade::scene {

/// What the file says of one material; nothing where it says nothing. Colours are RGBA, of glTF
/// linear, else sRGB.
struct FileMaterial {
  std::string name;
  std::optional<Eigen::Vector4f> baseColour;  ///< the diffuse one where there is no other
  Eigen::Vector3f emissive = Eigen::Vector3f::Zero();
  std::optional<float> metallic, roughness, opacity, alphaCutoff;
  std::optional<bool> doubleSided;
  std::string alphaMode;          ///< glTF's
  std::string baseColourTexture;  ///< the diffuse one where there is no other
  bool emissiveTexture = false;
};

struct FileToRead {
  std::string file;
  std::string text;    ///< in its place, where it was unzipped or mended
  bool isIfc = false;  ///< then only `text` counts
};

struct FileRead {
  const aiScene* scene = nullptr;       ///< lives as long as the process; null: `failure` says why
  std::vector<FileMaterial> materials;  ///< in assimp's order
  std::vector<std::string> files;       ///< that assimp opened or looked for
  std::string failure;
  std::string library;  ///< the file of assimp itself
};

std::filesystem::path assimpModule();

/// Sends progress on its way. Throws ImportError where the module cannot be opened.
FileRead readByAssimp(const FileToRead& file);

/// What the module exports, by the name kReadByAssimp. Whoever changes this, what it passes, or how
/// progress goes through the pipe gives it another number.
using ReadByAssimp = void(const FileToRead& file, FileRead& read);
inline constexpr const char* kReadByAssimp = "enfiladeReadByAssimp1";

}  // namespace enfilade::scene
