// The tree of nodes of assimp's scene: names, paths and transforms.
#include <assimp/scene.h>

#include <map>
#include <set>
#include <string_view>

#include "scene/import/assimp/convert_scene.hpp"

namespace enfilade::scene {
namespace {

constexpr double kGreatestEntry = 1e15;  // of a transform; beyond it boxes could overflow
constexpr int kDeepest = 2000;           // levels of nodes; more is a broken or malicious file

Eigen::Affine3d toDouble(const aiMatrix4x4& m) {
  Eigen::Affine3d result;
  result.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, 0, 0,
      0, 1;
  return result;
}

/// Bytes of the UTF-8 sequence at `i`, 0 when there is none.
std::size_t sequenceLength(std::string_view text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned char first = byte(i);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || i + length > text.size()) return 0;
  for (std::size_t k = i + 1; k < i + length; ++k) {
    if ((byte(k) & 0xc0) != 0x80) return 0;
  }
  // Overlong forms, surrogates and what lies beyond U+10FFFF.
  const unsigned char second = byte(i + 1);
  if ((first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f) ||
      (first == 0xf0 && second < 0x90) || (first == 0xf4 && second > 0x8f)) {
    return 0;
  }
  return length;
}

}  // namespace

std::string encodedName(std::string_view name) {
  static constexpr char kDigits[] = "0123456789ABCDEF";
  std::string result;
  for (std::size_t i = 0; i < name.size();) {
    const auto c = static_cast<unsigned char>(name[i]);
    const std::size_t length = sequenceLength(name, i);
    if (length == 0 || c < 0x20 || c == 0x7f || c == '/' || c == '%') {
      result += '%';
      result += kDigits[c >> 4];
      result += kDigits[c & 15];
      ++i;
    } else {
      result += name.substr(i, length);
      i += length;
    }
  }
  return result;
}

std::string SiblingNames::claim(const std::string& name) {
  std::string unique = name;
  std::size_t& repeats = repeats_[name];
  while (!taken_.insert(unique).second) {
    ++repeats;
    unique = name + "#" + std::to_string(repeats + 1);
  }
  return unique;
}

namespace {

bool isDigits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Names that assimp makes up for nodes without one; they count nodes, so they are not stable.
bool isMadeUp(std::string_view name) {
  if (name.starts_with("$ColladaAutoName$")) return true;
  if (name.starts_with("nodes[") && name.ends_with("]")) {
    return isDigits(name.substr(6, name.size() - 7));
  }
  return name.starts_with("nodes_") && isDigits(name.substr(6));
}

/// `IfcDoor_<Name>_<GlobalId>`: the last 22 characters, in the alphabet of GlobalIds.
std::string globalIdIn(std::string_view name) {
  static constexpr std::string_view kAlphabet =
      "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$";
  if (name.size() < 24 || !name.starts_with("Ifc") || name[name.size() - 23] != '_') return {};
  const std::string_view id = name.substr(name.size() - 22);
  if (id.find_first_not_of(kAlphabet) != std::string_view::npos) return {};
  return std::string(id);
}

class Collector {
 public:
  Collector(ModelFormat format, const GltfNodes& exact, const std::vector<Mesh>& meshes,
            ProblemLog& problems, NodePlaces& places)
      : ifc_(format == ModelFormat::ifc),
        exact_(exact),
        meshes_(meshes),
        problems_(problems),
        places_(places) {}

  Eigen::Affine3d parentFromNode(const aiNode& node) const {
    const auto exact = exact_.find(&node);
    return exact == exact_.end() ? toDouble(node.mTransformation) : exact->second.parentFromNode;
  }

  /// Where a node stands: what its parents made of the tree so far.
  struct Place {
    Eigen::Affine3d worldFromParent;
    std::string parentPath;  ///< with the '/' at its end, or empty
    SiblingNames* siblings;
    std::size_t product = kNone;  ///< index of the draft that takes meshes of nameless parts
    int depth = 0;
    std::optional<std::size_t> above = std::nullopt;  ///< number of the glTF node that it is of
  };
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  /// Tells of a node that floats place by steps that one could see.
  void judgePlacement(const aiNode& node, const Place& place) {
    if (exact_.contains(&node)) return;
    const Vec3 translation = toDouble(node.mTransformation).translation();
    const double step = (place.worldFromParent.linear() * translation).norm() * 0x1p-23;
    if (!(step > kCoarse)) return;
    problems_.add("coarse_placement", std::string(node.mName.C_Str(), node.mName.length) +
                                          ": steps of " + std::to_string(step) +
                                          " m; export it as glTF, whose numbers are read whole");
  }

  void visit(const aiNode& node, const Place& place) {
    if (place.depth > kDeepest) {
      throw ImportError("nodes are nested more than " + std::to_string(kDeepest) +
                        " levels deep; re-export the file with a flatter tree (convert)");
    }
    const std::string_view name(node.mName.C_Str(), node.mName.length);
    const Eigen::Affine3d worldFromNode = place.worldFromParent * parentFromNode(node);
    judgePlacement(node, place);
    if (ifc_ && name.starts_with("$Rel")) return visitChildren(node, passOn(place, worldFromNode));
    if (ifc_ && place.product != kNone && globalIdIn(name).empty()) {
      place_(node, worldFromNode, drafts_[place.product]);
      return visitChildren(node, passOn(place, worldFromNode));
    }
    const std::string path = place.parentPath + place.siblings->claim(segmentFor(name));
    const std::size_t draft = drafts_.size();
    ObjectDraft& made = drafts_.emplace_back();
    made.object.path = path;
    if (ifc_) made.object.globalId = globalIdIn(name);
    if (!made.object.globalId.empty()) made.object.ifcClass = name.substr(0, name.find('_'));
    if (isSolid(name, node)) place_(node, worldFromNode, drafts_[draft]);
    const bool takesParts = ifc_ && isSolid(name, node);
    SiblingNames names;
    Place below{worldFromNode,   path + "/", &names, takesParts ? draft : kNone,
                place.depth + 1, place.above};
    if (const auto known = exact_.find(&node); known != exact_.end()) {
      below.above = known->second.number;
      places_.emplace(known->second.number, NodePlace{path, worldFromNode, place.above});
    }
    visitChildren(node, below);
  }

  void visitChildren(const aiNode& node, const Place& place) {
    for (const aiNode* child : std::span(node.mChildren, node.mNumChildren)) visit(*child, place);
  }

  std::vector<ObjectDraft> take() {
    std::erase_if(drafts_, [](const ObjectDraft& draft) { return draft.placements.empty(); });
    return std::move(drafts_);
  }

 private:
  static Place passOn(const Place& place, const Eigen::Affine3d& worldFromNode) {
    return {worldFromNode, place.parentPath, place.siblings, place.product, place.depth + 1};
  }

  static std::string segmentFor(std::string_view name) {
    return name.empty() || isMadeUp(name) ? "node" : encodedName(name);
  }

  /// Spaces and openings are air.
  bool isSolid(std::string_view name, const aiNode& node) {
    if (!ifc_) return true;
    const bool air = name.starts_with("IfcSpace_") || name.starts_with("IfcOpeningElement_");
    if (air && node.mNumMeshes > 0) problems_.add("skipped_openings", std::string(name));
    return !air;
  }

  void place_(const aiNode& node, const Eigen::Affine3d& worldFromNode, ObjectDraft& draft) {
    const bool sane = worldFromNode.matrix().cwiseAbs().maxCoeff() <= kGreatestEntry &&
                      worldFromNode.matrix().allFinite();
    if (node.mNumMeshes > 0 && !sane) {
      problems_.add("broken_transform_dropped", draft.object.path);
      return;
    }
    for (const unsigned mesh : std::span(node.mMeshes, node.mNumMeshes)) {
      if (mesh >= meshes_.size() || meshes_[mesh].indices.empty()) continue;
      draft.placements.push_back({mesh, worldFromNode});
    }
  }

  bool ifc_;
  const GltfNodes& exact_;
  const std::vector<Mesh>& meshes_;
  ProblemLog& problems_;
  NodePlaces& places_;
  std::vector<ObjectDraft> drafts_;
};

/// Roots that are no node of the file: made by assimp, or named after the file, which may be
/// renamed without becoming another scene.
bool rootIsNoNode(const aiNode& root, ModelFormat format) {
  if (root.mNumMeshes > 0 || format == ModelFormat::ifc) return false;
  if (format != ModelFormat::gltf && format != ModelFormat::glb) return true;
  return std::string_view(root.mName.C_Str()) == "ROOT";
}

}  // namespace

std::vector<ObjectDraft> collectObjects(const aiScene& scene, ModelFormat format,
                                        const Eigen::Affine3d& worldFromRoot,
                                        const GltfNodes& exact, const std::vector<Mesh>& meshes,
                                        ProblemLog& problems, NodePlaces& places) {
  Collector collector(format, exact, meshes, problems, places);
  SiblingNames names;
  Collector::Place place{worldFromRoot, "", &names};
  const aiNode& root = *scene.mRootNode;
  if (rootIsNoNode(root, format)) {
    place.worldFromParent = worldFromRoot * collector.parentFromNode(root);
    collector.visitChildren(root, place);
  } else {
    collector.visit(root, place);
  }
  return collector.take();
}

}  // namespace enfilade::scene
