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

Eigen::Affine3d toAffine(const aiMatrix4x4& m) {
  Eigen::Affine3d result;
  result.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, 0, 0,
      0, 1;
  return result;
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
  NodeCollector(ModelFormat format, const std::vector<Mesh>& meshes,
                std::vector<Diagnostic>& diagnostics)
      : ifc_(format == ModelFormat::ifc), meshes_(meshes), diagnostics_(diagnostics) {}

  /// The state that a node inherits from its ancestors.
  struct VisitState {
    Eigen::Affine3d worldFromParent;
    std::string parentPath;  ///< ends with '/', or is empty
    SiblingNames* siblings;
    std::size_t product = kNone;  ///< index of the node that collects meshes of unnamed parts
    int depth = 0;
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
    const Eigen::Affine3d worldFromNode = state.worldFromParent * toAffine(node.mTransformation);
    reportCoarsePlacement(node, state);
    if (ifc_ && name.starts_with("$Rel"))
      return visitChildren(node, inheritState(state, worldFromNode));
    if (ifc_ && state.product != kNone && parseGlobalId(name).empty()) {
      placeMeshes(node, worldFromNode, importedNodes_[state.product]);
      return visitChildren(node, inheritState(state, worldFromNode));
    }
    std::string path = state.parentPath + state.siblings->makeUnique(makeNodeSegment(name));
    const std::size_t nodeIndex = importedNodes_.size();
    ImportedNode& imported = importedNodes_.emplace_back();
    imported.object.path = path;
    if (ifc_) imported.object.globalId = parseGlobalId(name);
    if (!imported.object.globalId.empty())
      imported.object.ifcClass = name.substr(0, name.find('_'));
    const bool solid = isSolid(name, node);
    if (solid) placeMeshes(node, worldFromNode, imported);
    SiblingNames names(node.mNumChildren);
    visitChildren(node, {worldFromNode, path + "/", &names, ifc_ && solid ? nodeIndex : kNone,
                         state.depth + 1});
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

  /// Spaces and openings are not solid.
  bool isSolid(std::string_view name, const aiNode& node) {
    if (!ifc_) return true;
    const bool air = name.starts_with("IfcSpace_") || name.starts_with("IfcOpeningElement_");
    if (air && node.mNumMeshes > 0)
      addDiagnostic(diagnostics_, "skipped_openings", std::string(name));
    return !air;
  }

  void placeMeshes(const aiNode& node, const Eigen::Affine3d& worldFromNode,
                   ImportedNode& imported) {
    addMeshInstances(std::span(node.mMeshes, node.mNumMeshes), worldFromNode, meshes_, imported,
                     diagnostics_);
  }

  bool ifc_;
  const std::vector<Mesh>& meshes_;
  std::vector<Diagnostic>& diagnostics_;
  std::vector<ImportedNode> importedNodes_;
};

/// Whether the root is not a node of the file, but assimp created it or named it after the file. A
/// renamed file must keep its paths.
bool isSyntheticRoot(const aiNode& root, ModelFormat format) {
  return root.mNumMeshes == 0 && format != ModelFormat::ifc;
}

}  // namespace

std::vector<ImportedNode> collectObjects(const aiScene& scene, ModelFormat format,
                                         const Eigen::Affine3d& worldFromRoot,
                                         const std::vector<Mesh>& meshes,
                                         std::vector<Diagnostic>& diagnostics) {
  NodeCollector collector(format, meshes, diagnostics);
  const aiNode& root = *scene.mRootNode;
  SiblingNames names(root.mNumChildren);
  NodeCollector::VisitState state{worldFromRoot, "", &names};
  if (isSyntheticRoot(root, format)) {
    state.worldFromParent = worldFromRoot * toAffine(root.mTransformation);
    collector.visitChildren(root, state);
  } else {
    collector.visit(root, state);
  }
  return collector.takeNodes();
}

}  // namespace enfilade::scene
