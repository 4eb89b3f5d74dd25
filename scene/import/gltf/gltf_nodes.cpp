#include "scene/import/gltf/gltf_nodes.hpp"

#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

/// Of a rotation's length from 1; three rounded digits make less.
constexpr double kMaxLengthError = 0.01;
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

/// Matches the file's tree to assimp's by structure: assimp keeps the order of children.
class NodeMatcher {
 public:
  NodeMatcher(const std::vector<PlainNode>& nodes, GltfNodes& matchedNodes,
              std::vector<Diagnostic>& diagnostics)
      : nodes_(nodes),
        matchedNodes_(matchedNodes),
        diagnostics_(diagnostics),
        isVisited_(nodes.size(), false) {}

  /// Stops where the trees differ, and reports it; assimp's transforms are used there.
  void visit(std::size_t index, const aiNode& node, int depth) {
    if (depth > kMaxNodeDepth) return;  // refused by the reader of the tree
    if (index >= nodes_.size() || !nodes_[index].isObject) return reportUnmatched(node);
    const PlainNode& plain = nodes_[index];
    const bool isShared = isVisited_[index];
    if (isShared && !isBelowShared_)
      addDiagnostic(diagnostics_, "shared_node",
                    describeNode(index, node) + " is listed several times");
    if (!isShared) reportTransform(plain.transform, index, node);
    isVisited_[index] = true;
    matchedNodes_.emplace(&node, GltfNode{&plain, index});
    const bool wasBelowShared = std::exchange(isBelowShared_, isBelowShared_ || isShared);
    visitChildren(plain.children, node, depth + 1);
    isBelowShared_ = wasBelowShared;
  }

  void visitChildren(const std::vector<std::size_t>& indices, const aiNode& parent, int depth) {
    if (indices.size() != parent.mNumChildren) return reportUnmatched(parent);
    for (std::size_t i = 0; i < indices.size(); ++i) visit(indices[i], *parent.mChildren[i], depth);
  }

 private:
  static std::string describeNode(std::size_t index, const aiNode& node) {
    return "nodes[" + std::to_string(index) + "] '" + node.mName.C_Str() + "'";
  }

  void reportUnmatched(const aiNode& node) {
    addDiagnostic(diagnostics_, "unmatched_node", node.mName.C_Str());
  }

  void reportTransform(const StatedTransform& transform, std::size_t index, const aiNode& node) {
    if (transform.fault == nullptr && transform.rotationLength == 1) return;
    const std::string name = describeNode(index, node) + ": ";
    if (transform.fault != nullptr)
      addDiagnostic(diagnostics_, "broken_transform_dropped", name + transform.fault);
    if (std::abs(transform.rotationLength - 1) > kMaxLengthError)
      addDiagnostic(diagnostics_, "rescaled_rotation",
                    name + "of length " + std::to_string(transform.rotationLength));
  }

  const std::vector<PlainNode>& nodes_;
  GltfNodes& matchedNodes_;
  std::vector<Diagnostic>& diagnostics_;
  std::vector<bool> isVisited_;  ///< by node
  bool isBelowShared_ = false;   ///< what is below a shared node is not reported by itself
};

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
  node.transform = readNodeTransform(json);
  node.attributes = readOwnAttributes(json);
  node.children = readIndices(getArray(json, "children"));
  return node;
}

GltfNodes matchGltfNodes(const aiScene& scene, const std::vector<PlainNode>& nodes,
                         const std::vector<std::size_t>& roots,
                         std::vector<Diagnostic>& diagnostics) {
  GltfNodes transforms;
  transforms.reserve(nodes.size());
  NodeMatcher walker(nodes, transforms, diagnostics);
  // assimp adds a root node above several roots, but not above a single one.
  if (roots.size() == 1) {
    walker.visit(roots[0], *scene.mRootNode, 0);
  } else {
    walker.visitChildren(roots, *scene.mRootNode, 0);
  }
  return transforms;
}

}  // namespace enfilade::scene
