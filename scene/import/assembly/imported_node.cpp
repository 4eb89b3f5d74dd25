#include "scene/import/assembly/imported_node.hpp"

#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {

void addMeshInstances(std::span<const unsigned> meshes, const Eigen::Affine3d& worldFromNode,
                      const std::vector<Mesh>& all, ImportedNode& imported,
                      std::vector<Diagnostic>& diagnostics) {
  constexpr double kMaxTransformEntry = 1e15;
  const bool sane = worldFromNode.matrix().cwiseAbs().maxCoeff() <= kMaxTransformEntry &&
                    worldFromNode.matrix().allFinite();
  if (!meshes.empty() && !sane) {
    addDiagnostic(diagnostics, "broken_transform_dropped", imported.object.path);
    return;
  }
  for (const unsigned mesh : meshes) {
    if (mesh >= all.size() || all[mesh].indices.empty()) continue;
    imported.instances.push_back({mesh, worldFromNode});
  }
}

}  // namespace enfilade::scene
