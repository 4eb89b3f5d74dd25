#include "scene/import/gltf/encoding/gltf_nodes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "scene/import/gltf/encoding/gltf_json.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxNameBytes = 1023;  // of a node
constexpr double kMaxLastRowError =
    1e-6;  ///< of a matrix from 0, 0, 0, 1; covers the rounding to floats

/// `count` finite numbers, or nullopt.
template <std::size_t count>
std::optional<std::array<double, count>> readNumbers(const Json& node, const char* key) {
  const auto found = node.find(key);
  if (found == node.end() || !found->is_array() || found->size() != count) return std::nullopt;
  std::array<double, count> numbers;
  for (std::size_t i = 0; i < count; ++i) {
    if (!(*found)[i].is_number()) return std::nullopt;
    numbers[i] = (*found)[i].template get<double>();
    if (!std::isfinite(numbers[i])) return std::nullopt;
  }
  return numbers;
}

/// The extras whose names begin with "_" and whose values are numbers: own attributes of instances.
std::vector<ObjectAttribute> readOwnAttributes(const Json& node) {
  std::vector<ObjectAttribute> attributes;
  const Json* extras = findMember(&node, "extras");
  if (extras == nullptr || !extras->is_object()) return attributes;
  for (const auto& [name, value] : extras->items()) {
    if (!name.starts_with("_")) continue;
    ObjectAttribute attribute{name, {}};
    const Json numbers = value.is_array() ? value : Json::array({value});
    for (const Json& number : numbers)
      if (number.is_number()) attribute.values.push_back(number.get<double>());
    if (!numbers.empty() && attribute.values.size() == numbers.size())
      attributes.push_back(std::move(attribute));
  }
  return attributes;
}

/// At most kMaxNameBytes, of whole characters.
std::string cutName(const std::string& name) {
  std::size_t size = std::min(name.size(), kMaxNameBytes);
  while (size > 0 && size < name.size() && (name[size] & 0xc0) == 0x80) --size;
  return name.substr(0, size);
}

std::size_t toIndex(const Json& value) {
  return value.is_number_unsigned() ? value.get<std::size_t>() : kNoIndex;
}

/// A member that is an index; kNoIndex if it is anything else, nullopt without it.
std::optional<std::size_t> readReference(const Json& node, const char* key) {
  const Json* index = findMember(&node, key);
  if (index == nullptr) return std::nullopt;
  return toIndex(*index);
}

Eigen::Affine3d readMatrix(const std::array<double, 16>& numbers, const char*& fault) {
  Eigen::Affine3d transform;
  for (int i = 0; i < 16; ++i)
    transform.matrix()(i % 4, i / 4) = numbers[static_cast<std::size_t>(i)];
  const Eigen::RowVector4d lastRow = transform.matrix().row(3);
  if ((lastRow - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > kMaxLastRowError)
    fault = "the last row of its matrix is not 0, 0, 0, 1";
  transform.makeAffine();
  return transform;
}

}  // namespace

StatedTransform readNodeTransform(const Json& node) {
  StatedTransform result;
  if (const auto m = readNumbers<16>(node, "matrix")) {
    result.parentFromNode = readMatrix(*m, result.fault);
    if (result.fault == nullptr &&
        std::ranges::any_of(std::array{"translation", "rotation", "scale"},
                            [&](const char* member) { return node.contains(member); }))
      result.fault = "its matrix counts, and its translation, rotation and scale do not";
    return result;
  }
  if (node.contains("matrix")) result.fault = "its matrix is not 16 numbers";
  if (const auto t = readNumbers<3>(node, "translation")) {
    result.parentFromNode.translate(Vec3((*t)[0], (*t)[1], (*t)[2]));
  } else if (node.contains("translation")) {
    result.fault = "its translation is not 3 numbers";
  }
  if (const auto r = readNumbers<4>(node, "rotation")) {
    const Eigen::Quaterniond rotation((*r)[3], (*r)[0], (*r)[1], (*r)[2]);
    result.rotationLength = rotation.norm();
    if (result.rotationLength > 0) {
      result.parentFromNode.rotate(rotation.normalized());
    } else {
      result.rotationLength = 1;
      result.fault = "its rotation is 0";
    }
  } else if (node.contains("rotation")) {
    result.fault = "its rotation is not 4 numbers";
  }
  if (const auto s = readNumbers<3>(node, "scale")) {
    result.parentFromNode.scale(Vec3((*s)[0], (*s)[1], (*s)[2]));
  } else if (node.contains("scale")) {
    result.fault = "its scale is not 3 numbers";
  }
  return result;
}

std::vector<std::size_t> readIndices(const Json& owner, const char* key) {
  const Json* list = findMember(&owner, key);
  if (list == nullptr) return {};
  if (!list->is_array()) return {kNoIndex};
  std::vector<std::size_t> indices;
  indices.reserve(list->size());
  for (const Json& index : *list) indices.push_back(toIndex(index));
  return indices;
}

PlainNode readPlainNode(const Json& json) {
  PlainNode node;
  if (!json.is_object()) return node;
  node.isObject = true;
  node.name = readEntryName(json);
  node.transform = readNodeTransform(json);
  node.attributes = readOwnAttributes(json);
  node.children = readIndices(json, "children");
  node.mesh = readReference(json, "mesh");
  node.camera = readReference(json, "camera");
  return node;
}

std::string readEntryName(const Json& entry) {
  const Json* name = findMember(&entry, "name");
  if (name == nullptr || !name->is_string()) return {};
  return cutName(name->get_ref<const std::string&>());
}

std::string describeEntry(const char* section, std::size_t index, const std::string& name) {
  const std::string place = std::string(section) + "[" + std::to_string(index) + "]";
  return name.empty() ? place : place + " '" + name + "'";
}

std::string describeNode(const PlainNode& node, std::size_t index) {
  return describeEntry("nodes", index, node.name);
}

std::vector<std::size_t> listSceneNodes(const GltfNodeTree& tree) {
  struct OpenNode {
    std::size_t node, nextChild;
  };
  const std::vector<PlainNode>& nodes = tree.nodes;
  std::vector<bool> isFound(nodes.size(), false);
  std::vector<std::size_t> finished;
  std::vector<OpenNode> open;
  const auto visit = [&](std::size_t node) {
    if (node >= nodes.size() || isFound[node]) return;
    isFound[node] = true;
    open.push_back({node, 0});
  };
  for (const std::size_t root : tree.roots) {
    visit(root);
    while (!open.empty()) {
      OpenNode& top = open.back();
      if (top.nextChild < nodes[top.node].children.size()) {
        visit(nodes[top.node].children[top.nextChild++]);
      } else {
        finished.push_back(top.node);
        open.pop_back();
      }
    }
  }
  return finished;
}

}  // namespace enfilade::scene
