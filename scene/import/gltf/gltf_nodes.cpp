#include "scene/import/gltf/gltf_nodes.hpp"

#include <assimp/scene.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "scene/import/gltf/encoding/gltf_json.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr double kMatchTolerance = 1e-4;  // of the largest entry; covers the rounding to floats

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

bool isSameTransform(const Eigen::Affine3d& exact, const aiMatrix4x4& rounded) {
  Eigen::Matrix<double, 3, 4> other;
  other << rounded.a1, rounded.a2, rounded.a3, rounded.a4, rounded.b1, rounded.b2, rounded.b3,
      rounded.b4, rounded.c1, rounded.c2, rounded.c3, rounded.c4;
  const Eigen::Matrix<double, 3, 4> exactRows = exact.matrix().topRows<3>();
  const double largest = std::max(exactRows.leftCols<3>().cwiseAbs().maxCoeff(), 1e-30);
  const double maxTranslation = exactRows.col(3).cwiseAbs().maxCoeff();
  return ((exactRows - other).leftCols<3>().cwiseAbs().maxCoeff() <= kMatchTolerance * largest) &&
         ((exactRows - other).col(3).cwiseAbs().maxCoeff() <= kMatchTolerance * maxTranslation);
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

/// The data that the import needs of a node of the JSON. A file may have a million nodes, so they
/// are read one by one, and their JSON is not kept.
struct PlainNode {
  bool isObject = false, hasChildList = true;
  Eigen::Affine3d parentFromNode = Eigen::Affine3d::Identity();
  std::vector<std::size_t> children;  ///< kNoIndex: not a number
  std::vector<ObjectAttribute> attributes;
};

std::vector<std::size_t> readIndices(const Json& list) {
  std::vector<std::size_t> indices;
  indices.reserve(list.size());
  for (const Json& index : list)
    indices.push_back(index.is_number_unsigned() ? index.get<std::size_t>() : kNoIndex);
  return indices;
}

PlainNode readPlainNode(const Json& json) {
  PlainNode node;
  if (!json.is_object()) return node;
  node.isObject = true;
  node.parentFromNode = readNodeTransform(json);
  node.attributes = readOwnAttributes(json);
  if (const Json* children = findMember(&json, "children")) {
    node.hasChildList = children->is_array();
    if (node.hasChildList) node.children = readIndices(*children);
  }
  return node;
}

/// Parses the scenes and, one by one, the nodes; null: not a JSON object.
Json parseScenesAndNodes(const std::string& text, std::vector<PlainNode>& nodes) {
  bool inNodes = false;
  const auto keep = [&](int depth, Json::parse_event_t event, Json& value) {
    using Event = Json::parse_event_t;
    if (event == Event::key && depth == 1) {
      inNodes = value == "nodes";
      return inNodes || value == "scene" || value == "scenes";
    }
    const bool ends =
        event == Event::object_end || event == Event::array_end || event == Event::value;
    if (!inNodes || depth != 2 || !ends) return true;
    nodes.push_back(readPlainNode(value));
    return false;
  };
  return Json::parse(text, keep, false);
}

class NodeMatcher {
 public:
  NodeMatcher(const std::vector<PlainNode>& nodes, GltfNodes& matchedNodes)
      : nodes_(nodes), matchedNodes_(matchedNodes) {}

  /// Stops where the trees differ; assimp's transforms are used there.
  void visit(std::size_t index, const aiNode& node, int depth) {
    if (index >= nodes_.size() || depth > kMaxNodeDepth || !nodes_[index].isObject) return;
    const PlainNode& plain = nodes_[index];
    if (!isSameTransform(plain.parentFromNode, node.mTransformation)) return;
    matchedNodes_.emplace(&node, GltfNode{plain.parentFromNode, index, plain.attributes});
    if (plain.hasChildList) visitChildren(plain.children, node, depth + 1);
  }

  void visitChildren(const std::vector<std::size_t>& indices, const aiNode& parent, int depth) {
    if (indices.size() != parent.mNumChildren) return;
    for (std::size_t i = 0; i < indices.size(); ++i) visit(indices[i], *parent.mChildren[i], depth);
  }

 private:
  const std::vector<PlainNode>& nodes_;
  GltfNodes& matchedNodes_;
};

}  // namespace

Eigen::Affine3d readNodeTransform(const Json& node) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  if (const auto m = readNumbers<16>(node, "matrix")) {
    for (int i = 0; i < 16; ++i) result.matrix()(i % 4, i / 4) = (*m)[static_cast<std::size_t>(i)];
    result.makeAffine();
    return result;
  }
  if (const auto t = readNumbers<3>(node, "translation")) {
    result.translate(Vec3((*t)[0], (*t)[1], (*t)[2]));
  }
  if (const auto r = readNumbers<4>(node, "rotation")) {
    const Eigen::Quaterniond rotation((*r)[3], (*r)[0], (*r)[1], (*r)[2]);
    if (rotation.norm() > 0) result.rotate(rotation.normalized());
  }
  if (const auto s = readNumbers<3>(node, "scale")) result.scale(Vec3((*s)[0], (*s)[1], (*s)[2]));
  return result;
}

GltfNodes readGltfNodes(const aiScene& scene, const std::string& gltfJson) {
  GltfNodes transforms;
  std::vector<PlainNode> nodes;
  const Json json = parseScenesAndNodes(gltfJson, nodes);
  if (!json.is_object()) return transforms;
  const Json& scenes = getArray(json, "scenes");
  const std::size_t index = readIndexMember(&json, "scene").value_or(0);
  if (index >= scenes.size()) return transforms;
  const std::vector<std::size_t> roots = readIndices(getArray(scenes[index], "nodes"));
  transforms.reserve(nodes.size());
  NodeMatcher walker(nodes, transforms);
  // assimp adds a root node above several roots, but not above a single one.
  if (roots.size() == 1) {
    walker.visit(roots[0], *scene.mRootNode, 0);
  } else {
    walker.visitChildren(roots, *scene.mRootNode, 0);
  }
  return transforms;
}

}  // namespace enfilade::scene
