#include "scene/import/gltf/unreadable_mesh.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;
using Corner = std::array<float, 3>;

/// The value of the largest integer of a component type (glTF 2.0, 3.6.2.2); 1 for floats.
double getFullScale(std::size_t componentType) {
  switch (componentType) {
    case 5120:
      return 127;
    case 5121:
      return 255;
    case 5122:
      return 32767;
    case 5123:
      return 65535;
    default:
      return 1;
  }
}

/// The member "min" or "max" of an accessor of positions.
std::optional<Corner> readCorner(const Json& accessor, const char* key) {
  const Json& numbers = getArray(accessor, key);
  if (numbers.size() != 3) return std::nullopt;
  const Json* normalised = findMember(&accessor, "normalized");
  const bool scaled = normalised != nullptr && *normalised == true;
  const double scale =
      scaled ? getFullScale(readIndexMember(&accessor, "componentType").value_or(0)) : 1;
  Corner corner{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!numbers[axis].is_number()) return std::nullopt;
    corner[axis] = static_cast<float>(numbers[axis].get<double>() / scale);
    if (!std::isfinite(corner[axis])) return std::nullopt;
  }
  return corner;
}

struct Extent {
  Corner min, max;
};

std::optional<Extent> readExtent(const Json& primitive, const Json& accessors) {
  const auto index = readIndexMember(findMember(&primitive, "attributes"), "POSITION");
  if (!index || *index >= accessors.size()) return std::nullopt;
  const auto min = readCorner(accessors[*index], "min");
  const auto max = readCorner(accessors[*index], "max");
  if (!min || !max) return std::nullopt;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if ((*min)[axis] > (*max)[axis]) return std::nullopt;
  return Extent{*min, *max};
}

}  // namespace

Json replaceUnreadable(const Json& primitive, const Json& accessors, const std::string& fault,
                       GltfBinary& binary, std::vector<Diagnostic>& problems) {
  const auto extent = readExtent(primitive, accessors);
  addDiagnostic(problems, extent ? "solid_mesh" : "missing_mesh", fault);
  if (!extent) return nullptr;
  std::vector<float> positions;
  for (unsigned corner = 0; corner < 8; ++corner)
    for (unsigned axis = 0; axis < 3; ++axis)
      positions.push_back((corner >> axis & 1U) != 0 ? extent->max[axis] : extent->min[axis]);
  static constexpr std::array<std::uint32_t, 36> kFaces{0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6,
                                                        0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7,
                                                        0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  Json box{{"attributes", {{"POSITION", binary.addFloats(positions, 3)}}},
           {"indices", binary.addIndices(kFaces)}};
  if (primitive.contains("material")) box["material"] = primitive["material"];
  return box;
}

}  // namespace enfilade::scene
