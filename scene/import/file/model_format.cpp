#include "scene/import/file/model_format.hpp"

#include <algorithm>
#include <array>

#include "scene/model/ascii.hpp"

namespace enfilade::scene {
namespace {

constexpr std::array<std::string_view, 11> kExtensions{
    ".gltf", ".glb", ".obj", ".dae", ".fbx", ".ifc", ".ifczip", ".ifcxml", ".zae", ".ply", ".stl"};
/// Formats of kExtensions.
constexpr std::array<ModelFormat, kExtensions.size()> kFormats{
    ModelFormat::gltf,    ModelFormat::glb, ModelFormat::obj, ModelFormat::collada,
    ModelFormat::fbx,     ModelFormat::ifc, ModelFormat::ifc, ModelFormat::ifc,
    ModelFormat::collada, ModelFormat::ply, ModelFormat::stl};

}  // namespace

std::optional<ModelFormat> detectModelFormat(const std::filesystem::path& file) {
  const std::string extension = toLowerCase(file.extension().string());
  const auto known = std::find(kExtensions.begin(), kExtensions.end(), extension);
  if (known == kExtensions.end()) return std::nullopt;
  return kFormats[static_cast<std::size_t>(known - kExtensions.begin())];
}

std::span<const std::string_view> listImportableExtensions() {
  return kExtensions;
}

}  // namespace enfilade::scene
