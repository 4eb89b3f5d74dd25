#include "scene/import/gltf/gltf_extensions.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/encoding/draco_mesh.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr const char* kVisibility = "KHR_node_visibility";

/// Extensions that are read; their names in full.
constexpr std::array<std::string_view, 10> kReadExtensions{
    kDracoExtension,           "KHR_mesh_quantization",
    "EXT_meshopt_compression", "KHR_meshopt_compression",
    "EXT_mesh_gpu_instancing", "KHR_physics_rigid_bodies",
    "KHR_implicit_shapes",     "KHR_texture_transform",
    "EXT_texture_webp",        "KHR_materials_pbrSpecularGlossiness"};

/// Of this one each texture without another image is reported as missing.
constexpr std::string_view kReportedExtension = "KHR_texture_basisu";

/// Beginnings of names of extensions that change the appearance or the animation alone.
constexpr std::array<std::string_view, 9> kAppearanceExtensions{
    "KHR_materials_", "KHR_texture_", "KHR_lights_",  "KHR_animation_pointer", "EXT_materials_",
    "EXT_texture_",   "EXT_lights_",  "MSFT_texture", "NV_materials_"};

/// Beginnings of names of other extensions that change neither shapes nor places if optional. They
/// are for metadata, physics, and alternatives to what the core of the file describes.
constexpr std::array<std::string_view, 25> kHarmlessExtensions{"MOZ_",
                                                               "OMI_",
                                                               "ASOBO_",
                                                               "MPEG_media",
                                                               "BLENDER_",
                                                               "KHR_xmp",
                                                               "KHR_audio",
                                                               "KHR_techniques",
                                                               "KHR_interactivity",
                                                               "KHR_node_hoverability",
                                                               "KHR_physics_",
                                                               "KHR_node_selectability",
                                                               "KHR_implicit_",
                                                               "EXT_mesh_features",
                                                               "EXT_mesh_manifold",
                                                               "EXT_instance_features",
                                                               "EXT_structural_metadata",
                                                               "EXT_feature_metadata",
                                                               "CESIUM_primitive_outline",
                                                               "MSFT_lod",
                                                               "MSFT_packing",
                                                               "AGI_stk_metadata",
                                                               "ADOBE_",
                                                               "FB_",
                                                               "GODOT_"};

template <class Beginnings>
bool beginsWithAny(const std::string& name, const Beginnings& beginnings) {
  return std::ranges::any_of(beginnings,
                             [&](std::string_view start) { return name.starts_with(start); });
}

bool isRead(const std::string& name) {
  return std::ranges::find(kReadExtensions, name) != kReadExtensions.end();
}

bool changesAppearanceAlone(const std::string& name) {
  return beginsWithAny(name, kAppearanceExtensions);
}

/// Whether the file describes the same shapes to a reader that does not know the extension.
bool mayBeIgnored(const std::string& name) {
  return isRead(name) || changesAppearanceAlone(name) || name.starts_with("VRM") ||
         beginsWithAny(name, kHarmlessExtensions);
}

/// The names in a list of the file. Throws ImportError if it is no list of names.
std::set<std::string> readRequired(const Json& gltf, const std::filesystem::path& file) {
  std::set<std::string> names;
  const auto found = gltf.find("extensionsRequired");
  if (found == gltf.end()) return names;
  const bool isList =
      found->is_array() &&
      std::all_of(found->begin(), found->end(), [](const Json& name) { return name.is_string(); });
  if (!isList)
    throw ImportError(file.string() +
                      ": extensionsRequired is not a list of names; export the file again");
  for (const Json& name : *found) names.insert(name.get<std::string>());
  return names;
}

[[noreturn]] void throwUnreadAppearance(const std::set<std::string>& names,
                                        const std::filesystem::path& file) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  throw ImportError(file.string() +
                    ": requires glTF extensions that are not supported and change the appearance "
                    "alone: " +
                    list + "; --ignore-appearance loads the file without them");
}

void addDiagnostic(const char* kind, const std::set<std::string>& names,
                   std::vector<Diagnostic>& problems) {
  if (!names.empty()) problems.push_back({kind, names.size(), *names.begin()});
}

}  // namespace

void ExtensionNames::seeKey(int depth, const std::string& key) {
  while (!open_.empty() && depth <= open_.back()) open_.pop_back();
  if (extras_ && depth <= *extras_) extras_.reset();
  isVisible_ = false;
  if (extras_) return;
  if (visibility_ && depth <= *visibility_) visibility_.reset();
  isVisible_ = visibility_ && depth == *visibility_ + 1 && key == "visible";
  if (!open_.empty() && depth == open_.back() + 1) {
    if (key == kVisibility) {
      visibility_ = depth;
    } else {
      names_.insert(key);
    }
  }
  if (key == "extensions") open_.push_back(depth);
  if (key == "extras") extras_ = depth;
}

void ExtensionNames::seeValue(const Json& value) {
  if (std::exchange(isVisible_, false) && value != true) names_.insert(kVisibility);
}

std::vector<Diagnostic> checkGltfExtensions(const Json& gltf, const ExtensionNames& inUse,
                                            const std::filesystem::path& file,
                                            bool ignoreAppearance) {
  std::set<std::string> appearance, ignored;
  for (const std::string& name : readRequired(gltf, file)) {
    if (isRead(name) || name == kReportedExtension) continue;
    if (!changesAppearanceAlone(name))
      throw ImportError(file.string() + ": requires the glTF extension " + name +
                        ", which is not supported; export without it");
    appearance.insert(name);
  }
  if (!appearance.empty() && !ignoreAppearance) throwUnreadAppearance(appearance, file);
  const auto used = gltf.find("extensionsUsed");
  if (used != gltf.end() && used->is_array()) {
    for (const Json& name : *used)
      if (name.is_string() && name != kVisibility && !mayBeIgnored(name.get<std::string>()))
        ignored.insert(name.get<std::string>());
  }
  for (const std::string& name : inUse.names())
    if (!mayBeIgnored(name)) ignored.insert(name);
  std::vector<Diagnostic> problems;
  addDiagnostic("ignored_extension", ignored, problems);
  addDiagnostic("ignored_appearance", appearance, problems);
  return problems;
}

}  // namespace enfilade::scene
