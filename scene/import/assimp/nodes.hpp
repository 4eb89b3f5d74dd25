// Collects objects from the node tree of assimp's scene: names, paths and transforms.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "scene/import/assembly/finish_model.hpp"
#include "scene/import/file/model_format.hpp"
#include "scene/import/gltf/gltf_nodes.hpp"

namespace enfilade::scene {

/// The nodes that have triangles, in document order. `worldFromRoot` is applied after the root's
/// own transform. The transforms of the nodes of `exact` are added to `transforms`, unless
/// it is null.
std::vector<ImportedNode> collectObjects(const aiScene& scene, ModelFormat format,
                                         const Eigen::Affine3d& worldFromRoot,
                                         const GltfNodes& exact, const std::vector<Mesh>& meshes,
                                         std::vector<Diagnostic>& diagnostics,
                                         NodeTransforms* transforms);

}  // namespace enfilade::scene
