// The assimp reader, built as a separate module: see assimp_reader.hpp.
#include <assimp/DefaultIOSystem.h>
#include <assimp/GltfMaterial.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/version.h>
#include <dlfcn.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <assimp/ProgressHandler.hpp>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string_view>
#include <type_traits>
#include <utility>

#include "scene/import/assimp/assimp_reader.hpp"
#include "scene/import/file/uri.hpp"
#include "scene/import/worker/ipc_messages.hpp"

namespace enfilade::scene {
namespace {

/// Forwards assimp's progress, at most once per percent.
class ProgressForwarder : public Assimp::ProgressHandler {
 public:
  bool Update(float fraction) override {
    const int percent = static_cast<int>(100 * fraction);
    if (percent > lastPercent_ && percent <= 100) sendProgress("parse", fraction);
    if (percent > lastPercent_) lastPercent_ = percent;
    return true;
  }

 private:
  int lastPercent_ = 0;
};

/// A text followed by a range of the bytes of a file.
class SplicedStream : public Assimp::IOStream {
 public:
  SplicedStream(const AssimpInput& input, std::unique_ptr<Assimp::IOStream> file)
      : text_(input.text),
        file_(std::move(file)),
        restAt_(input.restAt),
        size_(text_.size() + input.restBytes) {}

  std::size_t Read(void* to, std::size_t size, std::size_t count) override {
    if (size == 0) return 0;
    count = std::min(count, (size_ - at_) / size);
    const std::size_t bytes = size * count;
    const std::size_t fromText = std::min(bytes, text_.size() - std::min(at_, text_.size()));
    if (fromText > 0) std::memcpy(to, text_.data() + at_, fromText);
    at_ += fromText;
    if (bytes == fromText) return count;
    const bool found =
        file_->Seek(restAt_ + at_ - text_.size(), aiOrigin_SET) == aiReturn_SUCCESS &&
        file_->Read(static_cast<char*>(to) + fromText, bytes - fromText, 1) == 1;
    at_ += bytes - fromText;
    return found ? count : 0;
  }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    const std::size_t from = origin == aiOrigin_CUR ? at_ : origin == aiOrigin_END ? size_ : 0;
    if (offset > size_ - from) return aiReturn_FAILURE;
    at_ = from + offset;
    return aiReturn_SUCCESS;
  }
  std::size_t Tell() const override { return at_; }
  std::size_t FileSize() const override { return size_; }
  std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
  void Flush() override {}

 private:
  std::string_view text_;  ///< outlives the stream
  std::unique_ptr<Assimp::IOStream> file_;
  std::size_t restAt_, size_, at_ = 0;
};

/// Records the files that assimp opens or looks for, and substitutes the text for one file, or for
/// its start.
class TrackingIoSystem : public Assimp::DefaultIOSystem {
 public:
  TrackingIoSystem(const AssimpInput& input, std::vector<std::string>& dependencies)
      : input_(input), dependencies_(dependencies) {}

  bool Exists(const char* file) const override {
    if (isSubstituted(file)) return true;
    dependencies_.emplace_back(file);
    return DefaultIOSystem::Exists(file) || !findPercentDecoded(file).empty();
  }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (!isSubstituted(file)) {
      dependencies_.emplace_back(file);
      const std::string other = findPercentDecoded(file);
      return DefaultIOSystem::Open(other.empty() ? file : other.c_str(), mode);
    }
    if (input_.restBytes > 0) {
      std::unique_ptr<Assimp::IOStream> whole(DefaultIOSystem::Open(file, mode));
      return whole ? new SplicedStream(input_, std::move(whole)) : nullptr;
    }
    // assimp only reads from the stream, and the text outlives it.
    return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(input_.text.data()),
                                      input_.text.size());
  }

 private:
  bool isSubstituted(const char* file) const { return !input_.text.empty() && file == input_.file; }

  /// assimp 5.2.5 does not decode %20 and the like in URIs (RFC 3986). Returns the decoded name if
  /// only a file of that name exists, otherwise "".
  std::string findPercentDecoded(const std::string& file) const {
    if (DefaultIOSystem::Exists(file.c_str())) return "";
    std::string name = decodePercent(file);
    if (name == file) return "";
    dependencies_.push_back(name);
    return DefaultIOSystem::Exists(name.c_str()) ? name : "";
  }

  const AssimpInput& input_;
  std::vector<std::string>& dependencies_;
};

// ---- materials ----------------------------------------------------------------------------------

std::string toString(const aiString& text) {
  return {text.C_Str(), text.length};
}

template <typename T>
std::optional<T> getProperty(const aiMaterial& from, const char* key, unsigned type,
                             unsigned index) {
  T value{};
  return from.Get(key, type, index, value) == AI_SUCCESS ? std::optional(value) : std::nullopt;
}

std::optional<Eigen::Vector4f> getColour(const aiMaterial& from, const char* key, unsigned type,
                                         unsigned index) {
  const auto c = getProperty<aiColor4D>(from, key, type, index);
  if (!c) return std::nullopt;
  return Eigen::Vector4f(c->r, c->g, c->b, c->a);
}

std::string findBaseColourTexture(const aiMaterial& from) {
  for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
    aiString name;
    if (from.GetTexture(type, 0, &name) == AI_SUCCESS && name.length > 0) return toString(name);
  }
  return "";
}

FileMaterial readMaterial(const aiMaterial& from) {
  FileMaterial to;
  to.name = toString(const_cast<aiMaterial&>(from).GetName());
  to.baseColour = getColour(from, AI_MATKEY_BASE_COLOR);
  if (!to.baseColour) to.baseColour = getColour(from, AI_MATKEY_COLOR_DIFFUSE);
  if (const auto emissive = getColour(from, AI_MATKEY_COLOR_EMISSIVE))
    to.emissive = emissive->head<3>();
  to.metallic = getProperty<float>(from, AI_MATKEY_METALLIC_FACTOR);
  to.roughness = getProperty<float>(from, AI_MATKEY_ROUGHNESS_FACTOR);
  to.opacity = getProperty<float>(from, AI_MATKEY_OPACITY);
  to.alphaCutoff = getProperty<float>(from, AI_MATKEY_GLTF_ALPHACUTOFF);
  to.doubleSided = getProperty<bool>(from, AI_MATKEY_TWOSIDED);
  to.alphaMode =
      toString(getProperty<aiString>(from, AI_MATKEY_GLTF_ALPHAMODE).value_or(aiString()));
  to.baseColourTexture = findBaseColourTexture(from);
  to.emissiveTexture = from.GetTextureCount(aiTextureType_EMISSIVE) > 0;
  return to;
}

// ---- reading ------------------------------------------------------------------------------------

std::string findAssimpLibrary() {
  Dl_info info{};
  const bool found = dladdr(reinterpret_cast<const void*>(&aiGetVersionMajor), &info) != 0;
  return found && info.dli_fname ? info.dli_fname : "";
}

/// Whether assimp joins equal vertices right: it ignores colours, and one NaN makes it join others.
bool canBeJoined(const aiMesh* mesh) {
  return !mesh->HasVertexColors(0) &&
         std::all_of(mesh->mVertices, mesh->mVertices + mesh->mNumVertices,
                     [](const aiVector3D& v) {
                       return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
                     });
}

void readFile(const AssimpInput& file, AssimpOutput& to) {
  to.library = findAssimpLibrary();
  auto* importer = new Assimp::Importer;  // never deleted: destroying a large scene takes long
  // The importer owns both handlers.
  importer->SetIOHandler(new TrackingIoSystem(file, to.dependencies));
  importer->SetProgressHandler(new ProgressForwarder);
  importer->SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
  importer->SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, true);
  constexpr unsigned kSteps = aiProcess_Triangulate;
  const aiScene* scene =
      file.isIfc ? importer->ReadFileFromMemory(file.text.data(), file.text.size(), kSteps, "ifc")
                 : importer->ReadFile(file.file, kSteps);
  if (scene != nullptr) {
    to.joined = std::all_of(scene->mMeshes, scene->mMeshes + scene->mNumMeshes, canBeJoined);
    if (to.joined) scene = importer->ApplyPostProcessing(aiProcess_JoinIdenticalVertices);
  }
  if (scene == nullptr || scene->mRootNode == nullptr) {
    to.failure = importer->GetErrorString();
    return;
  }
  for (unsigned i = 0; i < scene->mNumMaterials; ++i)
    to.materials.push_back(readMaterial(*scene->mMaterials[i]));
  to.scene = scene;
}

}  // namespace
}  // namespace enfilade::scene

extern "C" [[gnu::visibility("default")]] void enfiladeReadByAssimp3(
    const enfilade::scene::AssimpInput& file, enfilade::scene::AssimpOutput& read) {
  enfilade::scene::readFile(file, read);
}
static_assert(std::is_same_v<decltype(enfiladeReadByAssimp3), enfilade::scene::AssimpReadFunction>);
