#include "scene/import/assimp/materials.hpp"

#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>

#include "scene/import/file/decode_image.hpp"
#include "scene/import/file/uri.hpp"
#include "scene/model/add_diagnostic.hpp"
#include "scene/model/srgb.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kMaxTextureSize = 1024;          // pixels a side; enough for a walk-through
constexpr std::size_t kMaxTextureBytes = 256u << 20;     // all decoded textures of a scene together
constexpr std::uintmax_t kMaxImageFileBytes = 1u << 30;  // bytes

float clampToUnit(float value, float fallback) {
  return std::isfinite(value) ? std::clamp(value, 0.0f, 1.0f) : fallback;
}

Eigen::Vector3f toLinearColour(const Eigen::Vector3f& c, bool linear) {
  const Eigen::Vector3f colour =
      c.unaryExpr([](float channel) { return clampToUnit(channel, 0.8f); });
  return linear ? colour : colour.unaryExpr(&srgbToLinear).eval();
}

// ---- textures -----------------------------------------------------------------------------------

/// Tries the path as written, then percent-decoded, then the decoded file name in the model's
/// folder. Every path tried is appended to `triedPaths`.
std::optional<fs::path> findImage(const fs::path& model, std::string name,
                                  std::vector<std::string>& triedPaths) {
  std::replace(name.begin(), name.end(), '\\', '/');
  if (name.starts_with("file://")) name.erase(0, 7);
  const fs::path folder = model.parent_path();
  const fs::path decoded = decodePercent(name);
  for (const fs::path& candidate : {folder / name, folder / decoded, folder / decoded.filename()}) {
    std::error_code error;
    triedPaths.push_back(candidate.string());
    if (fs::is_regular_file(candidate, error)) return candidate;
  }
  return std::nullopt;
}

std::optional<std::vector<std::byte>> readImageFile(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error || size > kMaxImageFileBytes) return std::nullopt;
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  return in ? std::optional(std::move(bytes)) : std::nullopt;
}

Texture convertRawTexture(const aiTexture& image) {
  Texture texture;
  texture.width = image.mWidth;
  texture.height = image.mHeight;
  const std::size_t pixels = std::size_t{image.mWidth} * image.mHeight;
  for (std::size_t i = 0; i < pixels; ++i) {
    const aiTexel& t = image.pcData[i];
    texture.rgba.insert(texture.rgba.end(), {t.r, t.g, t.b, t.a});
  }
  while (std::max(texture.width, texture.height) > kMaxTextureSize) halveTexture(texture);
  return texture;
}

class TextureTable {
 public:
  TextureTable(const aiScene& scene, const fs::path& file, Model& model)
      : scene_(scene), file_(file), model_(model) {}

  /// Index of the texture that a material names; loads it on the first call. -1: not available.
  std::int32_t findOrLoad(const std::string& name) {
    const auto [known, isNew] = indices_.try_emplace(name, -1);
    if (!isNew) return known->second;
    std::optional<Texture> texture = load(name);
    if (!texture) return -1;
    texture->name = name;
    known->second = static_cast<std::int32_t>(model_.textures.size());
    model_.textures.push_back(std::move(*texture));
    return known->second;
  }

 private:
  std::optional<Texture> load(const std::string& name) {
    if (const aiTexture* embedded = scene_.GetEmbeddedTexture(name.c_str())) {
      if (embedded->mHeight > 0) return convertRawTexture(*embedded);
      return decode(std::as_bytes(std::span(reinterpret_cast<const char*>(embedded->pcData),
                                            embedded->mWidth)),
                    name);
    }
    const std::optional<fs::path> file = findImage(file_, name, model_.dependencies);
    const auto bytes = file ? readImageFile(*file) : std::nullopt;
    if (!bytes) {
      addDiagnostic(model_.diagnostics, "missing_texture", shortenUri(name));
      return std::nullopt;
    }
    return decode(*bytes, name);
  }

  std::optional<Texture> decode(std::span<const std::byte> bytes, const std::string& name) {
    static constexpr std::string_view kKtx2 = "\xabKTX 20\xbb";
    if (bytes.size() >= kKtx2.size() &&
        std::memcmp(bytes.data(), kKtx2.data(), kKtx2.size()) == 0) {
      addDiagnostic(model_.diagnostics, "missing_texture",
                    shortenUri(name) + ": KTX2 images are not decoded; export PNG, JPEG or WebP");
      return std::nullopt;
    }
    auto image = decodeImage(bytes, kMaxTextureSize);
    if (auto* texture = std::get_if<Texture>(&image)) return std::move(*texture);
    addDiagnostic(model_.diagnostics, "unreadable_texture",
                  shortenUri(name) + ": " + std::get<std::string>(image));
    return std::nullopt;
  }

  const aiScene& scene_;
  const fs::path& file_;
  Model& model_;
  std::map<std::string, std::int32_t> indices_;
};

/// Halves the largest texture until all textures fit into kMaxTextureBytes.
void limitTextureMemory(Model& model) {
  std::size_t total = 0;
  for (const Texture& t : model.textures) total += t.rgba.size();
  while (total > kMaxTextureBytes) {
    const auto largest = std::max_element(
        model.textures.begin(), model.textures.end(),
        [](const Texture& a, const Texture& b) { return a.rgba.size() < b.rgba.size(); });
    total -= largest->rgba.size();
    halveTexture(*largest);
    total += largest->rgba.size();
    addDiagnostic(model.diagnostics, "reduced_texture", largest->name);
  }
}

// ---- materials ----------------------------------------------------------------------------------

void setAlpha(const FileMaterial& from, bool gltf, Material& to,
              std::vector<Diagnostic>& diagnostics) {
  if (!gltf) {
    float opacity = from.opacity.value_or(1);
    if (opacity == 0) {
      // Exporters disagree on the meaning of 0, and fully invisible surfaces are never intended.
      addDiagnostic(diagnostics, "opacity_zero", to.name + ": treated as opaque");
      opacity = 1;
    }
    to.baseColour.w() = clampToUnit(opacity, 1);
    if (to.baseColour.w() < 1) to.alpha = Material::Alpha::blend;
    return;
  }
  to.alphaCutoff = from.alphaCutoff.value_or(to.alphaCutoff);
  if (from.alphaMode == "MASK") to.alpha = Material::Alpha::mask;
  if (from.alphaMode == "BLEND") to.alpha = Material::Alpha::blend;
}

Material convertMaterial(const FileMaterial& from, bool gltf, TextureTable& textures,
                         std::vector<Diagnostic>& diagnostics) {
  Material to;
  to.name = from.name;
  if (from.baseColour) {
    to.baseColour.head<3>() = toLinearColour(from.baseColour->head<3>(), gltf);
    if (gltf) to.baseColour.w() = clampToUnit(from.baseColour->w(), 1);
  }
  to.emissive = toLinearColour(from.emissive, gltf);
  if (from.emissiveTexture && !to.emissive.isZero(0)) {
    // Without its texture, the factor would make the whole surface glow.
    addDiagnostic(diagnostics, "emissive_texture_ignored", to.name);
    to.emissive.setZero();
  }
  to.metallic = clampToUnit(from.metallic.value_or(to.metallic), 0);
  to.roughness = clampToUnit(from.roughness.value_or(to.roughness), 1);
  // Only glTF exporters set "single-sided" deliberately; in other formats walls would vanish.
  to.doubleSided = !gltf || from.doubleSided.value_or(false);
  setAlpha(from, gltf, to, diagnostics);
  to.alphaCutoff = clampToUnit(to.alphaCutoff, 0.5f);
  if (!from.baseColourTexture.empty())
    to.baseColourTexture = textures.findOrLoad(from.baseColourTexture);
  return to;
}

}  // namespace

void convertMaterials(const aiScene& scene, const std::vector<FileMaterial>& materials,
                      const fs::path& file, ModelFormat format, Model& model,
                      const ImportProgress& progress) {
  const bool gltf = format == ModelFormat::gltf || format == ModelFormat::glb;
  TextureTable textures(scene, file, model);
  for (std::size_t i = 0; i < materials.size(); ++i) {
    if (progress)
      progress("textures", static_cast<double>(i) / static_cast<double>(materials.size()));
    model.materials.push_back(convertMaterial(materials[i], gltf, textures, model.diagnostics));
  }
  if (model.materials.empty()) model.materials.emplace_back();
  limitTextureMemory(model);
}

}  // namespace enfilade::scene
