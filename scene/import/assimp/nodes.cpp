#include "scene/import/assimp/nodes.hpp"

#include <assimp/scene.h>

#include <span>
#include <string_view>

#include "scene/import/assembly/coordinates.hpp"
#include "scene/import/assembly/path_names.hpp"
#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMaxTransformEntry = 1e15;  // of a transform; beyond it, boxes could overflow

Eigen::Affine3d toAffine(const aiMatrix4x4& m) {
  Eigen::Affine3d result;
  result.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, 0, 0,
      0, 1;
  return result;
}

bool isDigits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Names that assimp generates for unnamed nodes. They contain a counter, so they are not stable.
bool isGeneratedName(std::string_view name) {
  if (name.starts_with("$ColladaAutoName$")) return true;
  if (name.starts_with("nodes[") && name.ends_with("]")) {
    return isDigits(name.substr(6, name.size() - 7));
  }
  return name.starts_with("nodes_") && isDigits(name.substr(6));
}

/// The GlobalId of a node named `IfcDoor_<Name>_<GlobalId>`: its last 22 characters, if they are in
/// the alphabet of GlobalIds; otherwise "".
std::string parseGlobalId(std::string_view name) {
  static constexpr std::string_view kAlphabet =
      "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$";
  if (name.size() < 24 || !name.starts_with("Ifc") || name[name.size() - 23] != '_') return {};
  const std::string_view id = name.substr(name.size() - 22);
  if (id.find_first_not_of(kAlphabet) != std::string_view::npos) return {};
  return std::string(id);
}

class NodeCollector {
 public:
  NodeCollector(ModelFormat format, const GltfNodes& exact, const std::vector<Mesh>& meshes,
                std::vector<Diagnostic>& diagnostics, NodeTransforms* transforms)
      : ifc_(format == ModelFormat::ifc),
        exactNodes_(exact),
        meshes_(meshes),
        diagnostics_(diagnostics),
        transforms_(transforms) {
    importedNodes_.reserve(exact.size());
  }

  /// The node of the glTF file; null: none, or its tree differs.
  const GltfNode* findExact(const aiNode& node) const {
    const auto exact = exactNodes_.find(&node);
    return exact == exactNodes_.end() ? nullptr : &exact->second;
  }

  static Eigen::Affine3d parentFromNode(const aiNode& node, const GltfNode* exact) {
    return exact == nullptr ? toAffine(node.mTransformation)
                            : exact->plain->transform.parentFromNode;
  }

  /// The state that a node inherits from its ancestors.
  struct VisitState {
    Eigen::Affine3d worldFromParent;
    std::string parentPath;  ///< ends with '/', or is empty
    SiblingNames* siblings;
    std::size_t product = kNone;  ///< index of the node that collects meshes of unnamed parts
    int depth = 0;
    std::optional<std::size_t> parentIndex = std::nullopt;  ///< index of the parent glTF node
  };
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  /// Reports a node whose float translation has visible rounding steps.
  void reportCoarsePlacement(const aiNode& node, const VisitState& state) {
    const Vec3 translation = toAffine(node.mTransformation).translation();
    const double step = (state.worldFromParent.linear() * translation).norm() * 0x1p-23;
    if (!(step > kMaxFloatSpacing)) return;
    addDiagnostic(diagnostics_, "coarse_placement",
                  std::string(node.mName.C_Str(), node.mName.length) + ": steps of " +
                      std::to_string(step) +
                      " m; export it as glTF, which is read in full precision");
  }

  void visit(const aiNode& node, const VisitState& state) {
    if (state.depth > kMaxNodeDepth) refuseDeepNodes("");
    const std::string_view name(node.mName.C_Str(), node.mName.length);
    const GltfNode* const exact = findExact(node);
    const Eigen::Affine3d worldFromNode = state.worldFromParent * parentFromNode(node, exact);
    if (exact == nullptr) reportCoarsePlacement(node, state);
    if (ifc_ && name.starts_with("$Rel"))
      return visitChildren(node, inheritState(state, worldFromNode));
    if (ifc_ && state.product != kNone && parseGlobalId(name).empty()) {
      addMeshInstances(node, worldFromNode, importedNodes_[state.product]);
      return visitChildren(node, inheritState(state, worldFromNode));
    }
    std::string path = state.parentPath + state.siblings->makeUnique(makePathSegment(name));
    const std::size_t nodeIndex = importedNodes_.size();
    ImportedNode& imported = importedNodes_.emplace_back();
    imported.object.path = path;
    if (ifc_) imported.object.globalId = parseGlobalId(name);
    if (!imported.object.globalId.empty())
      imported.object.ifcClass = name.substr(0, name.find('_'));
    if (isSolid(name, node)) addMeshInstances(node, worldFromNode, importedNodes_[nodeIndex]);
    const bool takesParts = ifc_ && isSolid(name, node);
    SiblingNames names(node.mNumChildren);
    VisitState childState{worldFromNode,   path + "/",       &names, takesParts ? nodeIndex : kNone,
                          state.depth + 1, state.parentIndex};
    if (exact != nullptr) {
      childState.parentIndex = exact->index;
      importedNodes_[nodeIndex].object.attributes = exact->plain->attributes;
      if (transforms_ != nullptr)
        transforms_->emplace(exact->index,
                             NodeTransform{std::move(path), worldFromNode, state.parentIndex});
    }
    visitChildren(node, childState);
  }

  void visitChildren(const aiNode& node, const VisitState& state) {
    for (const aiNode* child : std::span(node.mChildren, node.mNumChildren)) visit(*child, state);
  }

  std::vector<ImportedNode> takeNodes() {
    std::erase_if(importedNodes_,
                  [](const ImportedNode& imported) { return imported.instances.empty(); });
    return std::move(importedNodes_);
  }

 private:
  static VisitState inheritState(const VisitState& state, const Eigen::Affine3d& worldFromNode) {
    return {worldFromNode, state.parentPath, state.siblings, state.product, state.depth + 1};
  }

  static std::string makePathSegment(std::string_view name) {
    return name.empty() || isGeneratedName(name) ? "node" : encodePathSegment(name);
  }

  /// Spaces and openings are not solid.
  bool isSolid(std::string_view name, const aiNode& node) {
    if (!ifc_) return true;
    const bool air = name.starts_with("IfcSpace_") || name.starts_with("IfcOpeningElement_");
    if (air && node.mNumMeshes > 0)
      addDiagnostic(diagnostics_, "skipped_openings", std::string(name));
    return !air;
  }

  void addMeshInstances(const aiNode& node, const Eigen::Affine3d& worldFromNode,
                        ImportedNode& imported) {
    const bool sane = worldFromNode.matrix().cwiseAbs().maxCoeff() <= kMaxTransformEntry &&
                      worldFromNode.matrix().allFinite();
    if (node.mNumMeshes > 0 && !sane) {
      addDiagnostic(diagnostics_, "broken_transform_dropped", imported.object.path);
      return;
    }
    for (const unsigned mesh : std::span(node.mMeshes, node.mNumMeshes)) {
      if (mesh >= meshes_.size() || meshes_[mesh].indices.empty()) continue;
      imported.instances.push_back({mesh, worldFromNode});
    }
  }

  bool ifc_;
  const GltfNodes& exactNodes_;
  const std::vector<Mesh>& meshes_;
  std::vector<Diagnostic>& diagnostics_;
  NodeTransforms* transforms_;
  std::vector<ImportedNode> importedNodes_;
};

/// Whether the root is not a node of the file: assimp created it or named it after the file, and a
/// renamed file must keep its paths.
bool isSyntheticRoot(const aiNode& root, ModelFormat format) {
  if (root.mNumMeshes > 0 || format == ModelFormat::ifc) return false;
  if (format != ModelFormat::gltf && format != ModelFormat::glb) return true;
  return std::string_view(root.mName.C_Str()) == "ROOT";
}

}  // namespace

std::vector<ImportedNode> collectObjects(const aiScene& scene, ModelFormat format,
                                         const Eigen::Affine3d& worldFromRoot,
                                         const GltfNodes& exact, const std::vector<Mesh>& meshes,
                                         std::vector<Diagnostic>& diagnostics,
                                         NodeTransforms* transforms) {
  NodeCollector collector(format, exact, meshes, diagnostics, transforms);
  const aiNode& root = *scene.mRootNode;
  SiblingNames names(root.mNumChildren);
  NodeCollector::VisitState state{worldFromRoot, "", &names};
  if (isSyntheticRoot(root, format)) {
    state.worldFromParent =
        worldFromRoot * NodeCollector::parentFromNode(root, collector.findExact(root));
    collector.visitChildren(root, state);
  } else {
    collector.visit(root, state);
  }
  return collector.takeNodes();
}

}  // namespace enfilade::scene
