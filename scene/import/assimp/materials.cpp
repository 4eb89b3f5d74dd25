// Materials and textures of assimp's scene.
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "scene/import/assimp/convert_scene.hpp"
#include "scene/import/worker/decode_image.hpp"
#include "scene/import/worker/uri.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kLongestSide = 1024;       // pixels: what a walk-through can tell apart
constexpr std::size_t kTextureBytes = 256u << 20;  // of all textures of a scene, decoded
constexpr std::uintmax_t kLargestImageFile = 1u << 30;  // bytes

float unitInterval(float value, float otherwise) {
  return std::isfinite(value) ? std::clamp(value, 0.0f, 1.0f) : otherwise;
}

Eigen::Vector3f colourOf(const Eigen::Vector3f& c, bool linear) {
  const Eigen::Vector3f colour =
      c.unaryExpr([](float channel) { return unitInterval(channel, 0.8f); });
  return linear ? colour : colour.unaryExpr(&linearFromSrgb).eval();
}

// ---- textures -----------------------------------------------------------------------------------

/// As the file says it, then with %20 and the like read, then beside the model. `looked` takes down
/// where it was looked for.
std::optional<fs::path> findImage(const fs::path& model, std::string name,
                                  std::vector<std::string>& looked) {
  std::replace(name.begin(), name.end(), '\\', '/');
  if (name.starts_with("file://")) name.erase(0, 7);
  const fs::path folder = model.parent_path();
  const fs::path decoded = percentDecoded(name);
  for (const fs::path& candidate : {folder / name, folder / decoded, folder / decoded.filename()}) {
    std::error_code error;
    looked.push_back(candidate.string());
    if (fs::is_regular_file(candidate, error)) return candidate;
  }
  return std::nullopt;
}

std::optional<std::vector<std::byte>> readImageFile(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error || size > kLargestImageFile) return std::nullopt;
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  return in ? std::optional(std::move(bytes)) : std::nullopt;
}

Texture rawTexture(const aiTexture& image) {
  Texture texture;
  texture.width = image.mWidth;
  texture.height = image.mHeight;
  const std::size_t pixels = std::size_t{image.mWidth} * image.mHeight;
  for (std::size_t i = 0; i < pixels; ++i) {
    const aiTexel& t = image.pcData[i];
    texture.rgba.insert(texture.rgba.end(), {t.r, t.g, t.b, t.a});
  }
  while (std::max(texture.width, texture.height) > kLongestSide) halve(texture);
  return texture;
}

class Textures {
 public:
  Textures(const aiScene& scene, const ConvertInput& input, Model& model, ProblemLog& problems)
      : scene_(scene), input_(input), model_(model), problems_(problems) {}

  /// The index of the texture named so by a material, read at the first call; -1: cannot be had.
  std::int32_t index(const std::string& name) {
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
      if (embedded->mHeight > 0) return rawTexture(*embedded);
      return decode(std::as_bytes(std::span(reinterpret_cast<const char*>(embedded->pcData),
                                            embedded->mWidth)),
                    name);
    }
    const std::optional<fs::path> file = findImage(input_.file, name, model_.filesBeside);
    const auto bytes = file ? readImageFile(*file) : std::nullopt;
    if (!bytes) {
      problems_.add("missing_texture", name);
      return std::nullopt;
    }
    return decode(*bytes, name);
  }

  std::optional<Texture> decode(std::span<const std::byte> bytes, const std::string& name) {
    auto image = decodeImage(bytes, kLongestSide);
    if (auto* texture = std::get_if<Texture>(&image)) return std::move(*texture);
    problems_.add("unreadable_texture", name + ": " + std::get<std::string>(image));
    return std::nullopt;
  }

  const aiScene& scene_;
  const ConvertInput& input_;
  Model& model_;
  ProblemLog& problems_;
  std::map<std::string, std::int32_t> indices_;
};

/// Halves the largest textures until all together fit.
void fitTextures(Model& model, ProblemLog& problems) {
  std::size_t total = 0;
  for (const Texture& t : model.textures) total += t.rgba.size();
  while (total > kTextureBytes) {
    const auto largest = std::max_element(
        model.textures.begin(), model.textures.end(),
        [](const Texture& a, const Texture& b) { return a.rgba.size() < b.rgba.size(); });
    total -= largest->rgba.size();
    halve(*largest);
    total += largest->rgba.size();
    problems.add("reduced_texture", largest->name);
  }
}

// ---- materials ----------------------------------------------------------------------------------

void setAlpha(const FileMaterial& from, bool gltf, Material& to, ProblemLog& problems) {
  if (!gltf) {
    float opacity = from.opacity.value_or(1);
    if (opacity == 0) {
      // Exporters disagree on what 0 means; nobody models walls that cannot be seen at all.
      problems.add("opacity_zero", to.name + ": taken for opaque");
      opacity = 1;
    }
    to.baseColour.w() = unitInterval(opacity, 1);
    if (to.baseColour.w() < 1) to.alpha = Material::Alpha::blend;
    return;
  }
  to.alphaCutoff = from.alphaCutoff.value_or(to.alphaCutoff);
  if (from.alphaMode == "MASK") to.alpha = Material::Alpha::mask;
  if (from.alphaMode == "BLEND") to.alpha = Material::Alpha::blend;
}

Material convertMaterial(const FileMaterial& from, bool gltf, Textures& textures,
                         ProblemLog& problems) {
  Material to;
  to.name = from.name;
  if (from.baseColour) {
    to.baseColour.head<3>() = colourOf(from.baseColour->head<3>(), gltf);
    if (gltf) to.baseColour.w() = unitInterval(from.baseColour->w(), 1);
  }
  to.emissive = colourOf(from.emissive, gltf);
  if (from.emissiveTexture && !to.emissive.isZero(0)) {
    // The factor alone would make all of it glow.
    problems.add("emissive_texture_ignored", to.name);
    to.emissive.setZero();
  }
  to.metallic = unitInterval(from.metallic.value_or(to.metallic), 0);
  to.roughness = unitInterval(from.roughness.value_or(to.roughness), 1);
  // Only glTF's exporters mean it when they say one side: elsewhere a wall would vanish.
  to.doubleSided = !gltf || from.doubleSided.value_or(false);
  setAlpha(from, gltf, to, problems);
  to.alphaCutoff = unitInterval(to.alphaCutoff, 0.5f);
  if (!from.baseColourTexture.empty())
    to.baseColourTexture = textures.index(from.baseColourTexture);
  return to;
}

}  // namespace

float linearFromSrgb(float c) {
  const double s = std::clamp(static_cast<double>(c), 0.0, 1.0);
  return static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
}

void convertMaterials(const aiScene& scene, const std::vector<FileMaterial>& materials,
                      const ConvertInput& input, Model& model, ProblemLog& problems,
                      const ImportProgress& progress) {
  const bool gltf = input.format == ModelFormat::gltf || input.format == ModelFormat::glb;
  Textures textures(scene, input, model, problems);
  for (std::size_t i = 0; i < materials.size(); ++i) {
    if (progress)
      progress("textures", static_cast<double>(i) / static_cast<double>(materials.size()));
    model.materials.push_back(convertMaterial(materials[i], gltf, textures, problems));
  }
  if (model.materials.empty()) model.materials.emplace_back();
  fitTextures(model, problems);
}

}  // namespace enfilade::scene
