#include "scene/import/gltf/unreadable_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/model/add_diagnostic.hpp"
#include "scene/model/box_mesh.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

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
std::optional<Vec3> readCorner(const Json& accessor, const char* key) {
  const Json& numbers = getArray(accessor, key);
  if (numbers.size() != 3) return std::nullopt;
  const Json* normalised = findMember(&accessor, "normalized");
  const bool scaled = normalised != nullptr && *normalised == true;
  const double scale =
      scaled ? getFullScale(readIndexMember(&accessor, "componentType").value_or(0)) : 1;
  Vec3 corner;
  for (int axis = 0; axis < 3; ++axis) {
    const Json& number = numbers[static_cast<std::size_t>(axis)];
    if (!number.is_number()) return std::nullopt;
    corner[axis] = number.get<double>() / scale;
    if (!std::isfinite(static_cast<float>(corner[axis]))) return std::nullopt;
  }
  return corner;
}

/// The extent that an accessor of positions states; nullopt without a valid one.
std::optional<Aabb> readExtent(const std::optional<std::size_t>& accessor, const Json& accessors) {
  if (!accessor || *accessor >= accessors.size()) return std::nullopt;
  const auto min = readCorner(accessors[*accessor], "min");
  const auto max = readCorner(accessors[*accessor], "max");
  if (!min || !max) return std::nullopt;
  const Aabb box{*min, *max};
  return box.empty() ? std::nullopt : std::optional(box);
}

/// Adds the stated extents of morph targets times their weights. False if one states none.
bool morphBox(const RestPose& pose, const Json& targets, const Json& accessors, Aabb& box) {
  for (std::size_t t = 0; t < std::min(targets.size(), pose.morphWeights.size()); ++t) {
    const double weight = pose.morphWeights[t];
    if (weight == 0 || findMember(&targets[t], "POSITION") == nullptr) continue;
    const auto offsets = readExtent(readIndexMember(&targets[t], "POSITION"), accessors);
    if (!offsets) return false;
    box.min += weight * (weight > 0 ? offsets->min : offsets->max);
    box.max += weight * (weight > 0 ? offsets->max : offsets->min);
  }
  return true;
}

/// The box in the rest pose. Adds to `fault` what could not be applied.
Aabb poseBox(const RestPose& pose, Aabb box, const Json& primitive, const Json& accessors,
             GltfBuffers& buffers, std::string& fault) {
  if (!morphBox(pose, getArray(primitive, "targets"), accessors, box))
    fault += "; its box is without morph targets, because one states no extent";
  if (pose.nodeFromJoint.empty()) return box;
  try {
    return computePosedBox(pose, box, primitive, buffers, "a primitive");
  } catch (const UnreadableGltf&) {
    throw;
  } catch (const ImportError&) {
    fault += "; its box is not posed by its skin, because its joints cannot be read either";
  }
  return box;
}

}  // namespace

Json replaceUnreadable(const UnreadableMesh& mesh, const Json& accessors, GltfBuffers& buffers,
                       GltfBinary& binary, std::vector<Diagnostic>& problems) {
  const Json& primitive = mesh.primitive;
  std::optional<Aabb> box =
      readExtent(readIndexMember(findMember(&primitive, "attributes"), "POSITION"), accessors);
  std::string fault = mesh.fault;
  if (box && mesh.pose != nullptr)
    box = poseBox(*mesh.pose, *box, primitive, accessors, buffers, fault);
  addDiagnostic(problems, box ? "solid_mesh" : "missing_mesh", fault);
  if (!box) return nullptr;
  std::vector<float> positions;
  for (unsigned corner = 0; corner < 8; ++corner)
    for (const double coordinate : computeBoxCorner(*box, corner))
      positions.push_back(static_cast<float>(coordinate));
  static constexpr std::array<std::uint32_t, 36> kFaces{0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6,
                                                        0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7,
                                                        0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  Json solid{{"attributes", {{"POSITION", binary.addFloats(positions, 3)}}},
             {"indices", binary.addIndices(kFaces)}};
  if (primitive.contains("material")) solid["material"] = primitive["material"];
  return solid;
}

}  // namespace enfilade::scene
