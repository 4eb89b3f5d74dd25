// The transforms of a glTF file's nodes as the file says them. assimp rounds them to floats, and a
// translation of five thousand kilometres to half a metre; here the JSON is read once more, and its
// tree walked beside assimp's.
#include <assimp/scene.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "scene/import/assimp/convert_scene.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr int kDeepest = 2000;   // levels; collectObjects() refuses more
constexpr double kAlike = 1e-4;  // of the largest entry: what a float's rounding may make of it
constexpr std::size_t kGlbHeader = 20;  // bytes: file header and that of the first chunk

/// `count` finite numbers, or nullopt.
template <std::size_t count>
std::optional<std::array<double, count>> numbersOf(const Json& node, const char* key) {
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

Eigen::Affine3d transformOf(const Json& node) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  if (const auto m = numbersOf<16>(node, "matrix")) {
    for (int i = 0; i < 16; ++i) result.matrix()(i % 4, i / 4) = (*m)[static_cast<std::size_t>(i)];
    result.makeAffine();
    return result;
  }
  if (const auto t = numbersOf<3>(node, "translation")) {
    result.translate(Vec3((*t)[0], (*t)[1], (*t)[2]));
  }
  if (const auto r = numbersOf<4>(node, "rotation")) {
    const Eigen::Quaterniond turn((*r)[3], (*r)[0], (*r)[1], (*r)[2]);
    if (turn.norm() > 0) result.rotate(turn.normalized());
  }
  if (const auto s = numbersOf<3>(node, "scale")) result.scale(Vec3((*s)[0], (*s)[1], (*s)[2]));
  return result;
}

bool alike(const Eigen::Affine3d& exact, const aiMatrix4x4& rounded) {
  Eigen::Matrix<double, 3, 4> other;
  other << rounded.a1, rounded.a2, rounded.a3, rounded.a4, rounded.b1, rounded.b2, rounded.b3,
      rounded.b4, rounded.c1, rounded.c2, rounded.c3, rounded.c4;
  const Eigen::Matrix<double, 3, 4> mine = exact.matrix().topRows<3>();
  const double largest = std::max(mine.leftCols<3>().cwiseAbs().maxCoeff(), 1e-30);
  const double farthest = mine.col(3).cwiseAbs().maxCoeff();
  return ((mine - other).leftCols<3>().cwiseAbs().maxCoeff() <= kAlike * largest) &&
         ((mine - other).col(3).cwiseAbs().maxCoeff() <= kAlike * farthest);
}

class Walker {
 public:
  Walker(const Json& nodes, GltfNodes& into) : nodes_(nodes), into_(into) {}

  /// Stops where the trees are not the same: assimp's numbers hold there.
  void visit(const Json& index, const aiNode& node, int depth) {
    if (!index.is_number_unsigned() || depth > kDeepest) return;
    const auto i = index.get<std::size_t>();
    if (i >= nodes_.size() || !nodes_[i].is_object()) return;
    const Json& json = nodes_[i];
    const Eigen::Affine3d exact = transformOf(json);
    if (!alike(exact, node.mTransformation)) return;
    into_.emplace(&node, GltfNode{exact, i});
    visitAll(json.value("children", Json::array()), node, depth + 1);
  }

  void visitAll(const Json& indices, const aiNode& parent, int depth) {
    if (!indices.is_array() || indices.size() != parent.mNumChildren) return;
    for (std::size_t i = 0; i < indices.size(); ++i) {
      visit(indices[i], *parent.mChildren[i], depth);
    }
  }

 private:
  const Json& nodes_;
  GltfNodes& into_;
};

}  // namespace

std::string gltfText(const std::filesystem::path& file, ModelFormat format) {
  std::ifstream in(file, std::ios::binary);
  if (format == ModelFormat::gltf) return {std::istreambuf_iterator<char>(in), {}};
  std::array<char, kGlbHeader> header{};
  in.read(header.data(), header.size());
  std::uint32_t length = 0;
  std::memcpy(&length, header.data() + 12, sizeof length);
  std::error_code error;
  if (!in || length > file_size(file, error)) return {};
  std::string text(length, '\0');
  in.read(text.data(), length);
  return text;
}

GltfNodes exactGltfNodes(const aiScene& scene, const std::filesystem::path& file,
                         ModelFormat format) {
  GltfNodes transforms;
  const Json json = Json::parse(gltfText(file, format), nullptr, false);
  if (!json.is_object() || !json.contains("nodes") || !json.contains("scenes")) return transforms;
  if (!json["nodes"].is_array()) return transforms;
  const Json chosen = json.value("scene", Json(0u));
  const std::size_t index = chosen.is_number_unsigned() ? chosen.get<std::size_t>() : 0;
  if (!json["scenes"].is_array() || index >= json["scenes"].size()) return transforms;
  const Json& one = json["scenes"][index];
  const Json roots = one.is_object() ? one.value("nodes", Json::array()) : Json::array();
  Walker walker(json["nodes"], transforms);
  // assimp puts a node of its own above several roots, and none above one.
  if (roots.is_array() && roots.size() == 1) {
    walker.visit(roots[0], *scene.mRootNode, 0);
  } else {
    walker.visitAll(roots, *scene.mRootNode, 0);
  }
  return transforms;
}

}  // namespace enfilade::scene
