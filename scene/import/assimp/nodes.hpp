// Collects objects from the node tree of assimp's scene: names, paths and transforms.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "scene/import/assembly/imported_node.hpp"
#include "scene/import/file/model_format.hpp"

struct aiScene;

namespace enfilade::scene {

/// The nodes that have triangles, in document order. `worldFromRoot` is applied after the root's
/// own transform. For glTF: collectGltfNodes().
std::vector<ImportedNode> collectObjects(const aiScene& scene, ModelFormat format,
                                         const Eigen::Affine3d& worldFromRoot,
                                         const std::vector<Mesh>& meshes,
                                         std::vector<Diagnostic>& diagnostics);

}  // namespace enfilade::scene
