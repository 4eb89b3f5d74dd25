#include "scene/import/gltf/gltf_extensions.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "scene/import/file/import_options.hpp"

namespace enfilade::scene {
namespace {

/// Extensions that are read; their names in full.
constexpr std::array<std::string_view, 7> kReadExtensions{
    "KHR_draco_mesh_compression", "KHR_mesh_quantization",   "EXT_meshopt_compression",
    "KHR_meshopt_compression",    "EXT_mesh_gpu_instancing", "KHR_physics_rigid_bodies",
    "KHR_implicit_shapes"};

/// Beginnings of names of extensions that change neither shapes nor places: appearance, metadata,
/// animation, and alternatives to what the core of the file describes.
constexpr std::array<std::string_view, 35> kHarmlessExtensions{"MOZ_",
                                                               "OMI_",
                                                               "NV_materials_",
                                                               "ASOBO_",
                                                               "MPEG_media",
                                                               "BLENDER_",
                                                               "KHR_materials_",
                                                               "KHR_texture_",
                                                               "KHR_lights_",
                                                               "KHR_xmp",
                                                               "KHR_animation_pointer",
                                                               "KHR_audio",
                                                               "KHR_techniques",
                                                               "KHR_interactivity",
                                                               "KHR_node_hoverability",
                                                               "KHR_physics_",
                                                               "KHR_node_selectability",
                                                               "EXT_texture_",
                                                               "EXT_lights_",
                                                               "EXT_materials_",
                                                               "EXT_mesh_features",
                                                               "EXT_mesh_manifold",
                                                               "EXT_instance_features",
                                                               "EXT_structural_metadata",
                                                               "EXT_feature_metadata",
                                                               "CESIUM_primitive_outline",
                                                               "MSFT_texture",
                                                               "MSFT_lod",
                                                               "MSFT_packing",
                                                               "AGI_",
                                                               "ADOBE_",
                                                               "FB_",
                                                               "GODOT_",
                                                               "VRM",
                                                               "KHR_implicit_"};

bool isSupportedExtension(const std::string& extension) {
  const auto begins = [&](std::string_view start) { return extension.starts_with(start); };
  return std::find(kReadExtensions.begin(), kReadExtensions.end(), extension) !=
             kReadExtensions.end() ||
         std::any_of(kHarmlessExtensions.begin(), kHarmlessExtensions.end(), begins);
}

/// The unsupported names in a list of the file.
std::set<std::string> findUnsupported(const nlohmann::json& gltf, const char* list) {
  std::set<std::string> names;
  const auto found = gltf.find(list);
  if (found == gltf.end() || !found->is_array()) return names;
  for (const nlohmann::json& name : *found) {
    if (name.is_string() && !isSupportedExtension(name.get<std::string>()))
      names.insert(name.get<std::string>());
  }
  return names;
}

}  // namespace

void ExtensionNames::seeKey(int depth, const std::string& key) {
  while (!open_.empty() && depth <= open_.back()) open_.pop_back();
  if (extras_ && depth <= *extras_) extras_.reset();
  if (extras_) return;
  if (!open_.empty() && depth == open_.back() + 1) names_.insert(key);
  if (key == "extensions") open_.push_back(depth);
  if (key == "extras") extras_ = depth;
}

std::vector<Diagnostic> checkGltfExtensions(const nlohmann::json& gltf, const ExtensionNames& inUse,
                                            const std::filesystem::path& file) {
  for (const std::string& name : findUnsupported(gltf, "extensionsRequired")) {
    throw ImportError(file.string() + ": requires the glTF extension " + name +
                      ", which is not supported; export without it");
  }
  std::set<std::string> ignored = findUnsupported(gltf, "extensionsUsed");
  for (const std::string& name : inUse.names())
    if (!isSupportedExtension(name)) ignored.insert(name);
  if (ignored.empty()) return {};
  return {{"ignored_extension", ignored.size(), *ignored.begin()}};
}

}  // namespace enfilade::scene
