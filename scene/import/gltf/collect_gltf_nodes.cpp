#include "scene/import/gltf/collect_gltf_nodes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "scene/import/assembly/path_names.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

/// Of a rotation's length from 1; three rounded digits make less.
constexpr double kMaxLengthError = 0.01;

class GltfNodeCollector {
 public:
  GltfNodeCollector(const GltfNodeTree& tree, const GltfMeshes& meshes,
                    std::vector<Diagnostic>& diagnostics, NodeTransforms* transforms)
      : tree_(tree),
        meshes_(meshes),
        diagnostics_(diagnostics),
        transforms_(transforms),
        isVisited_(tree.nodes.size(), false) {
    importedNodes_.reserve(static_cast<std::size_t>(std::ranges::count_if(
        tree.nodes, [](const PlainNode& node) { return node.mesh.has_value(); })));
  }

  /// The state that a node inherits from its ancestors.
  struct VisitState {
    Eigen::Affine3d worldFromParent;
    std::string parentPath;  ///< ends with '/', or is empty
    SiblingNames* siblings;
    std::optional<std::size_t> parent = std::nullopt;  ///< index of a node
  };

  void visit(std::size_t index, const VisitState& state) {
    const PlainNode& node = tree_.nodes[index];
    const bool wasBelowShared = isBelowShared_;
    reportNode(index);
    const Eigen::Affine3d worldFromNode = state.worldFromParent * node.transform.parentFromNode;
    std::string path = state.parentPath + state.siblings->makeUnique(makeNodeSegment(node.name));
    if (node.mesh) addObject(node, path, worldFromNode);
    if (!node.children.empty()) {
      SiblingNames names(node.children.size());
      visitChildren(node.children, {worldFromNode, path + "/", &names, index});
    }
    if (transforms_ != nullptr)
      transforms_->emplace(index, NodeTransform{std::move(path), worldFromNode, state.parent});
    isBelowShared_ = wasBelowShared;
  }

  void visitChildren(const std::vector<std::size_t>& children, const VisitState& state) {
    for (const std::size_t child : children) visit(child, state);
  }

  /// Each further listing of a node is reported, but not of those below it.
  void reportNode(std::size_t index) {
    const PlainNode& node = tree_.nodes[index];
    const bool isShared = isVisited_[index];
    isVisited_[index] = true;
    if (!isShared) return reportTransform(node, index);
    if (!isBelowShared_)
      addDiagnostic(diagnostics_, "shared_node",
                    describeNode(node, index) + " is listed several times");
    isBelowShared_ = true;
  }

  std::vector<ImportedNode> takeNodes() { return std::move(importedNodes_); }

 private:
  void addObject(const PlainNode& node, const std::string& path,
                 const Eigen::Affine3d& worldFromNode) {
    ImportedNode imported;
    imported.object.path = path;
    imported.object.attributes = node.attributes;
    addMeshInstances(meshes_.parts.at(*node.mesh), worldFromNode, meshes_.all, imported,
                     diagnostics_);
    if (!imported.instances.empty()) importedNodes_.push_back(std::move(imported));
  }

  void reportTransform(const PlainNode& node, std::size_t index) {
    const StatedTransform& transform = node.transform;
    if (transform.fault != nullptr)
      addDiagnostic(diagnostics_, "broken_transform_dropped",
                    describeNode(node, index) + ": " + transform.fault);
    if (std::abs(transform.rotationLength - 1) > kMaxLengthError)
      addDiagnostic(
          diagnostics_, "rescaled_rotation",
          describeNode(node, index) + ": of length " + std::to_string(transform.rotationLength));
  }

  const GltfNodeTree& tree_;
  const GltfMeshes& meshes_;
  std::vector<Diagnostic>& diagnostics_;
  NodeTransforms* transforms_;
  std::vector<bool> isVisited_;  ///< by node
  bool isBelowShared_ = false;
  std::vector<ImportedNode> importedNodes_;
};

/// Whether a node is the one that assimp writes above the roots of a scene. It is not in paths.
bool isWrittenRoot(const PlainNode& node) {
  return !node.mesh && node.name == "ROOT";
}

}  // namespace

std::vector<ImportedNode> collectGltfNodes(const GltfNodeTree& tree, const GltfMeshes& meshes,
                                           const Eigen::Affine3d& worldFromRoot,
                                           std::vector<Diagnostic>& diagnostics,
                                           NodeTransforms* transforms) {
  GltfNodeCollector collector(tree, meshes, diagnostics, transforms);
  const bool written = tree.roots.size() == 1 && isWrittenRoot(tree.nodes[tree.roots[0]]);
  const std::vector<std::size_t>& top = written ? tree.nodes[tree.roots[0]].children : tree.roots;
  SiblingNames names(top.size());
  GltfNodeCollector::VisitState state{worldFromRoot, "", &names};
  if (written) {
    collector.reportNode(tree.roots[0]);
    state.worldFromParent = worldFromRoot * tree.nodes[tree.roots[0]].transform.parentFromNode;
  }
  collector.visitChildren(top, state);
  return collector.takeNodes();
}

}  // namespace enfilade::scene
