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

class NodeMatcher {
 public:
  NodeMatcher(const Json& nodes, GltfNodes& matchedNodes)
      : nodes_(nodes), matchedNodes_(matchedNodes) {}

  /// Stops where the trees differ; assimp's transforms are used there.
  void visit(const Json& index, const aiNode& node, int depth) {
    if (!index.is_number_unsigned() || depth > kMaxNodeDepth) return;
    const auto i = index.get<std::size_t>();
    if (i >= nodes_.size() || !nodes_[i].is_object()) return;
    const Json& json = nodes_[i];
    const Eigen::Affine3d exact = readNodeTransform(json);
    if (!isSameTransform(exact, node.mTransformation)) return;
    matchedNodes_.emplace(&node, GltfNode{exact, i});
    visitChildren(json.value("children", Json::array()), node, depth + 1);
  }

  void visitChildren(const Json& indices, const aiNode& parent, int depth) {
    if (!indices.is_array() || indices.size() != parent.mNumChildren) return;
    for (std::size_t i = 0; i < indices.size(); ++i) {
      visit(indices[i], *parent.mChildren[i], depth);
    }
  }

 private:
  const Json& nodes_;
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
  const Json json = Json::parse(gltfJson, nullptr, false);
  if (!json.is_object() || !json.contains("nodes") || !json.contains("scenes")) return transforms;
  if (!json["nodes"].is_array()) return transforms;
  const Json chosen = json.value("scene", Json(0u));
  const std::size_t index = chosen.is_number_unsigned() ? chosen.get<std::size_t>() : 0;
  if (!json["scenes"].is_array() || index >= json["scenes"].size()) return transforms;
  const Json& one = json["scenes"][index];
  const Json roots = one.is_object() ? one.value("nodes", Json::array()) : Json::array();
  NodeMatcher walker(json["nodes"], transforms);
  // assimp adds a root node above several roots, but not above a single one.
  if (roots.is_array() && roots.size() == 1) {
    walker.visit(roots[0], *scene.mRootNode, 0);
  } else {
    walker.visitChildren(roots, *scene.mRootNode, 0);
  }
  return transforms;
}

}  // namespace enfilade::scene
