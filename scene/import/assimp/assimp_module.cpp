// A library of its own: see assimp_reader.hpp.
#include <assimp/DefaultIOSystem.h>
#include <assimp/GltfMaterial.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/version.h>
#include <dlfcn.h>

#include <assimp/Importer.hpp>
#include <assimp/ProgressHandler.hpp>
#include <cstdint>
#include <type_traits>
#include <utility>

#include "scene/import/assimp/assimp_reader.hpp"
#include "scene/import/worker/ipc_messages.hpp"
#include "scene/import/worker/uri.hpp"

namespace enfilade::scene {
namespace {

/// Passes assimp's progress on, at most a hundred times.
class ForwardProgress : public Assimp::ProgressHandler {
 public:
  bool Update(float fraction) override {
    const int percent = static_cast<int>(100 * fraction);
    if (percent > last_ && percent <= 100) sendProgress("parse", fraction);
    if (percent > last_) last_ = percent;
    return true;
  }

 private:
  int last_ = 0;
};

/// Takes down which files assimp opens and looks for, and gives it a mended text for one of them.
class WatchedFiles : public Assimp::DefaultIOSystem {
 public:
  WatchedFiles(const FileToRead& mended, std::vector<std::string>& names)
      : mended_(mended), names_(names) {}

  bool Exists(const char* file) const override {
    names_.emplace_back(file);
    return DefaultIOSystem::Exists(file) || !decoded(file).empty();
  }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    names_.emplace_back(file);
    if (mended_.text.empty() || file != mended_.file) {
      const std::string other = decoded(file);
      return DefaultIOSystem::Open(other.empty() ? file : other.c_str(), mode);
    }
    // assimp only reads from it, and the text lives longer.
    return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(mended_.text.data()),
                                      mended_.text.size());
  }

 private:
  /// URIs say %20 for a blank (RFC 3986), which assimp 5.2.5 leaves as it is. The name without
  /// such, if only that is there; else empty.
  std::string decoded(const std::string& file) const {
    if (DefaultIOSystem::Exists(file.c_str())) return "";
    std::string name = percentDecoded(file);
    if (name == file) return "";
    names_.push_back(name);
    return DefaultIOSystem::Exists(name.c_str()) ? name : "";
  }

  const FileToRead& mended_;
  std::vector<std::string>& names_;
};

// ---- materials ----------------------------------------------------------------------------------

std::string textOf(const aiString& text) {
  return {text.C_Str(), text.length};
}

template <typename T>
std::optional<T> property(const aiMaterial& from, const char* key, unsigned type, unsigned index) {
  T value{};
  return from.Get(key, type, index, value) == AI_SUCCESS ? std::optional(value) : std::nullopt;
}

std::optional<Eigen::Vector4f> colour(const aiMaterial& from, const char* key, unsigned type,
                                      unsigned index) {
  const auto c = property<aiColor4D>(from, key, type, index);
  if (!c) return std::nullopt;
  return Eigen::Vector4f(c->r, c->g, c->b, c->a);
}

std::string baseColourTexture(const aiMaterial& from) {
  for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
    aiString name;
    if (from.GetTexture(type, 0, &name) == AI_SUCCESS && name.length > 0) return textOf(name);
  }
  return "";
}

FileMaterial fileMaterial(const aiMaterial& from) {
  FileMaterial to;
  to.name = textOf(const_cast<aiMaterial&>(from).GetName());
  to.baseColour = colour(from, AI_MATKEY_BASE_COLOR);
  if (!to.baseColour) to.baseColour = colour(from, AI_MATKEY_COLOR_DIFFUSE);
  if (const auto emissive = colour(from, AI_MATKEY_COLOR_EMISSIVE))
    to.emissive = emissive->head<3>();
  to.metallic = property<float>(from, AI_MATKEY_METALLIC_FACTOR);
  to.roughness = property<float>(from, AI_MATKEY_ROUGHNESS_FACTOR);
  to.opacity = property<float>(from, AI_MATKEY_OPACITY);
  to.alphaCutoff = property<float>(from, AI_MATKEY_GLTF_ALPHACUTOFF);
  to.doubleSided = property<bool>(from, AI_MATKEY_TWOSIDED);
  to.alphaMode = textOf(property<aiString>(from, AI_MATKEY_GLTF_ALPHAMODE).value_or(aiString()));
  to.baseColourTexture = baseColourTexture(from);
  to.emissiveTexture = from.GetTextureCount(aiTextureType_EMISSIVE) > 0;
  return to;
}

// ---- reading ------------------------------------------------------------------------------------

std::string ownFile() {
  Dl_info info{};
  const bool found = dladdr(reinterpret_cast<const void*>(&aiGetVersionMajor), &info) != 0;
  return found && info.dli_fname ? info.dli_fname : "";
}

void read(const FileToRead& file, FileRead& to) {
  to.library = ownFile();
  auto* importer = new Assimp::Importer;  // left to _exit: tearing a large scene down takes time
  // The importer deletes both.
  importer->SetIOHandler(new WatchedFiles(file, to.files));
  importer->SetProgressHandler(new ForwardProgress);
  importer->SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
  importer->SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, true);
  constexpr unsigned kSteps = aiProcess_Triangulate | aiProcess_JoinIdenticalVertices;
  const aiScene* scene =
      file.isIfc ? importer->ReadFileFromMemory(file.text.data(), file.text.size(), kSteps, "ifc")
                 : importer->ReadFile(file.file, kSteps);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    to.failure = importer->GetErrorString();
    return;
  }
  for (unsigned i = 0; i < scene->mNumMaterials; ++i)
    to.materials.push_back(fileMaterial(*scene->mMaterials[i]));
  to.scene = scene;
}

}  // namespace
}  // namespace enfilade::scene

extern "C" [[gnu::visibility("default")]] void enfiladeReadByAssimp1(
    const enfilade::scene::FileToRead& file, enfilade::scene::FileRead& read) {
  enfilade::scene::read(file, read);
}
static_assert(std::is_same_v<decltype(enfiladeReadByAssimp1), enfilade::scene::ReadByAssimp>);
