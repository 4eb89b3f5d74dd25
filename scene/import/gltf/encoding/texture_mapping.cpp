#include "scene/import/gltf/encoding/texture_mapping.hpp"

#include <cmath>

#include "scene/import/gltf/encoding/gltf_json.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr const char* kTextureTransform = "KHR_texture_transform";

double readMappingNumber(const Json* numbers, std::size_t index, double fallback) {
  const bool known = numbers != nullptr && numbers->is_array() && index < numbers->size() &&
                     (*numbers)[index].is_number();
  const double value = known ? (*numbers)[index].get<double>() : fallback;
  return std::isfinite(value) ? value : fallback;
}

const Json* findBaseColourTexture(const Json& material) {
  return findMember(findMember(&material, "pbrMetallicRoughness"), "baseColorTexture");
}

}  // namespace

bool TextureMapping::isIdentity() const {
  return offset[0] == 0 && offset[1] == 0 && scale[0] == 1 && scale[1] == 1 && rotation == 0;
}

std::string TextureMapping::makeKey() const {
  return Json({offset[0], offset[1], scale[0], scale[1], rotation}).dump();
}

void TextureMapping::apply(std::span<float> uvs) const {
  // Scaled, then rotated counter-clockwise as people see it (v points down), then moved.
  const double c = std::cos(rotation), s = std::sin(rotation);
  for (std::size_t i = 0; i + 1 < uvs.size(); i += 2) {
    const double u = scale[0] * uvs[i], v = scale[1] * uvs[i + 1];
    uvs[i] = static_cast<float>(c * u + s * v + offset[0]);
    uvs[i + 1] = static_cast<float>(c * v - s * u + offset[1]);
  }
}

TextureMapping readTextureMapping(const Json& gltf, std::size_t material) {
  TextureMapping mapping;
  const Json* materials = findMember(&gltf, "materials");
  if (materials == nullptr || !materials->is_array() || material >= materials->size())
    return mapping;
  const Json* texture = findBaseColourTexture((*materials)[material]);
  const Json* transform = findMember(findMember(texture, "extensions"), kTextureTransform);
  mapping.isTextured = texture != nullptr;
  mapping.set = readIndexMember(texture, "texCoord").value_or(0);
  if (transform == nullptr) return mapping;
  mapping.set = readIndexMember(transform, "texCoord").value_or(mapping.set);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    mapping.offset[axis] = readMappingNumber(findMember(transform, "offset"), axis, 0);
    mapping.scale[axis] = readMappingNumber(findMember(transform, "scale"), axis, 1);
  }
  const Json* rotation = findMember(transform, "rotation");
  if (rotation != nullptr && rotation->is_number()) mapping.rotation = rotation->get<double>();
  if (!std::isfinite(mapping.rotation)) mapping.rotation = 0;
  return mapping;
}

}  // namespace enfilade::scene
