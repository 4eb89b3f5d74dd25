#include "scene/import/gltf/gltf_materials.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr const char* kSpecularGlossiness = "KHR_materials_pbrSpecularGlossiness";
constexpr std::array<const char*, 3> kImageExtensions{"EXT_texture_webp", "KHR_texture_basisu",
                                                      "EXT_texture_avif"};

/// Whether a reference to a texture leads to an image, or does not exist.
bool isPlainTexture(const Json* reference, const Json& textures) {
  if (reference == nullptr) return true;
  const Json* texture = findEntry(textures, findMember(reference, "index"));
  return readIndexMember(texture, "source").has_value();
}

void chooseImages(Json& gltf) {
  const auto textures = gltf.find("textures");
  if (textures == gltf.end() || !textures->is_array()) return;
  const std::size_t images = getArray(gltf, "images").size();
  for (Json& texture : *textures) {
    if (!texture.is_object()) texture = Json::object();
    if (const auto source = readIndexMember(&texture, "source"); !source || *source >= images)
      texture.erase("source");
    for (const char* name : kImageExtensions) {
      const auto source =
          readIndexMember(findMember(findMember(&texture, "extensions"), name), "source");
      if (source && *source < images && !texture.contains("source")) texture["source"] = *source;
    }
  }
}

/// The extensions of a texture without an image, as " (NAME)".
std::string listTextureExtensions(const Json* reference, const Json& textures) {
  const Json* texture = findEntry(textures, findMember(reference, "index"));
  const Json* extensions = findMember(texture, "extensions");
  if (extensions == nullptr || !extensions->is_object() || extensions->empty()) return "";
  return " (" + extensions->begin().key() + ")";
}

/// Removes a reference without an image. Returns whether there was one.
bool removeTexture(Json& owner, const char* member, const Json& textures) {
  if (!owner.is_object() || isPlainTexture(findMember(&owner, member), textures)) return false;
  owner.erase(member);
  return true;
}

void dropTexturesWithoutImage(Json& material, const std::string& name, const Json& textures,
                              std::vector<Diagnostic>& problems) {
  const auto remove = [&](Json& owner, const char* member) {
    const std::string extensions = listTextureExtensions(findMember(&owner, member), textures);
    if (!removeTexture(owner, member, textures)) return false;
    addDiagnostic(problems, "missing_texture",
                  name + ": its " + member + " has no image that is read" + extensions);
    return true;
  };
  // Without its texture, the factor would make the whole surface glow.
  if (remove(material, "emissiveTexture")) material["emissiveFactor"] = {0, 0, 0};
  const auto metallic = material.find("pbrMetallicRoughness");
  if (metallic != material.end()) remove(*metallic, "baseColorTexture");
}

void simplifyMaterial(Json& material) {
  for (const char* unread : {"normalTexture", "occlusionTexture", "extensions"})
    material.erase(unread);
  const auto metallic = material.find("pbrMetallicRoughness");
  if (metallic == material.end() || !metallic->is_object()) return;
  metallic->erase("metallicRoughnessTexture");
  const auto base = metallic->find("baseColorTexture");
  if (base == metallic->end() || !base->is_object()) return;
  for (const char* mapping : {"texCoord", "extensions"}) base->erase(mapping);
}

}  // namespace

bool hasPlainTextures(const Json& gltf) {
  const Json &materials = getArray(gltf, "materials"), &textures = getArray(gltf, "textures");
  return std::all_of(materials.begin(), materials.end(), [&](const Json& material) {
    const Json* metallic = findMember(&material, "pbrMetallicRoughness");
    return isPlainTexture(findMember(metallic, "baseColorTexture"), textures) &&
           isPlainTexture(findMember(&material, "emissiveTexture"), textures);
  });
}

void replaceSpecularGlossiness(Json& gltf) {
  const auto materials = gltf.find("materials");
  if (materials == gltf.end() || !materials->is_array()) return;
  for (Json& material : *materials) {
    const Json* found = findMember(findMember(&material, "extensions"), kSpecularGlossiness);
    if (found == nullptr || !found->is_object() || material.contains("pbrMetallicRoughness"))
      continue;
    Json metallic{{"metallicFactor", 0}};
    if (const Json* factor = findMember(found, "diffuseFactor"))
      metallic["baseColorFactor"] = *factor;
    if (const Json* texture = findMember(found, "diffuseTexture"))
      metallic["baseColorTexture"] = *texture;
    const Json* glossiness = findMember(found, "glossinessFactor");
    const bool stated = glossiness != nullptr && glossiness->is_number();
    metallic["roughnessFactor"] = stated ? 1 - glossiness->get<double>() : 0.0;
    material["pbrMetallicRoughness"] = std::move(metallic);
  }
}

void dropMissingTextures(Json& gltf, std::vector<Diagnostic>& problems) {
  chooseImages(gltf);
  const auto materials = gltf.find("materials");
  if (materials == gltf.end() || !materials->is_array()) return;
  for (std::size_t m = 0; m < materials->size(); ++m)
    if ((*materials)[m].is_object())
      dropTexturesWithoutImage((*materials)[m], "materials[" + std::to_string(m) + "]",
                               getArray(gltf, "textures"), problems);
}

void simplifyMaterials(Json& gltf) {
  const auto materials = gltf.find("materials");
  if (materials == gltf.end() || !materials->is_array()) return;
  for (Json& material : *materials)
    if (material.is_object()) simplifyMaterial(material);
}

}  // namespace enfilade::scene
