#include "server/export/glb_materials.hpp"

#include <algorithm>

#include "render/image/encode.hpp"
#include "server/export/draw_groups.hpp"

namespace enfilade::server {
namespace {

/// Of opaque textures that compress better as JPEG than as PNG: no difference is visible.
constexpr int kTextureQuality = 92;

float clampToUnit(float value) {
  return std::clamp(value, 0.0f, 1.0f);
}

GlbJson makeMaterialJson(const scene::Material& material) {
  const auto& colour = material.baseColour;
  GlbJson json = GlbJson::object();
  if (!material.name.empty()) json["name"] = material.name;
  json["pbrMetallicRoughness"] = {{"baseColorFactor",
                                   {clampToUnit(colour.x()), clampToUnit(colour.y()),
                                    clampToUnit(colour.z()), clampToUnit(colour.w())}},
                                  {"metallicFactor", clampToUnit(material.metallic)},
                                  {"roughnessFactor", clampToUnit(material.roughness)}};
  if (material.emissive.maxCoeff() > 0)
    json["emissiveFactor"] = {clampToUnit(material.emissive.x()),
                              clampToUnit(material.emissive.y()),
                              clampToUnit(material.emissive.z())};
  if (material.alpha == scene::Material::Alpha::blend) json["alphaMode"] = "BLEND";
  if (material.alpha == scene::Material::Alpha::mask) {
    json["alphaMode"] = "MASK";
    json["alphaCutoff"] = std::max(material.alphaCutoff, 0.0f);
  }
  if (material.doubleSided) json["doubleSided"] = true;
  return json;
}

struct EncodedTexture {
  render::Bytes bytes;
  const char* mimeType = "image/png";
};

/// PNG, without alpha if the texture is opaque; JPEG if it needs less than half of that.
EncodedTexture encodeTexture(const scene::Texture& texture) {
  const auto width = static_cast<int>(texture.width), height = static_cast<int>(texture.height);
  bool isOpaque = true;
  std::vector<std::uint8_t> rgb;
  rgb.reserve(texture.rgba.size() / 4 * 3);
  for (std::size_t i = 0; i + 3 < texture.rgba.size(); i += 4) {
    rgb.insert(rgb.end(), texture.rgba.begin() + static_cast<std::ptrdiff_t>(i),
               texture.rgba.begin() + static_cast<std::ptrdiff_t>(i + 3));
    isOpaque = isOpaque && texture.rgba[i + 3] == 255;
  }
  if (!isOpaque)
    return {render::encodePng(render::Raster<std::uint8_t>{width, height, 4, texture.rgba})};
  const render::Raster<std::uint8_t> pixels{width, height, 3, rgb};
  EncodedTexture png{render::encodePng(pixels)};
  EncodedTexture jpeg{render::encodeJpeg(pixels, kTextureQuality), "image/jpeg"};
  return jpeg.bytes.size() < png.bytes.size() / 2 ? jpeg : png;
}

}  // namespace

GlbMaterials::GlbMaterials(const scene::Model& model, GlbFile& file, bool withTextures)
    : model_(model),
      file_(file),
      withTextures_(withTextures),
      equalTextures_(findEqualTextures(model)) {}

const scene::Material& GlbMaterials::find(std::uint32_t material) const {
  static const scene::Material none;
  return material < model_.materials.size() ? model_.materials[material] : none;
}

bool GlbMaterials::isTextured(std::uint32_t material) const {
  const std::int32_t texture = find(material).baseColourTexture;
  return withTextures_ && texture >= 0 &&
         static_cast<std::size_t>(texture) < model_.textures.size();
}

std::size_t GlbMaterials::add(std::uint32_t material) {
  const auto found = materials_.find(material);
  if (found != materials_.end()) return found->second;
  GlbJson json = makeMaterialJson(find(material));
  if (isTextured(material)) {
    const auto texture = static_cast<std::size_t>(find(material).baseColourTexture);
    json["pbrMetallicRoughness"]["baseColorTexture"] = {
        {"index", addTexture(equalTextures_[texture])}};
  }
  return materials_[material] = file_.add("materials", std::move(json));
}

std::size_t GlbMaterials::addTexture(std::size_t texture) {
  const auto found = textures_.find(texture);
  if (found != textures_.end()) return found->second;
  const scene::Texture& source = model_.textures[texture];
  const EncodedTexture encoded = encodeTexture(source);
  const std::size_t image = file_.addImage(encoded.bytes, encoded.mimeType, source.name);
  return textures_[texture] = file_.add("textures", {{"source", image}});
}

}  // namespace enfilade::server
