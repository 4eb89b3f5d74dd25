// Collects objects from the nodes of a glTF file: paths, transforms in doubles, and meshes as
// assimp read them. Private to the import.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "scene/import/assembly/imported_node.hpp"
#include "scene/import/gltf/encoding/gltf_nodes.hpp"

namespace enfilade::scene {

/// The meshes of a file as they were read, one for each primitive.
struct GltfMeshes {
  const std::vector<Mesh>& all;
  std::vector<std::span<const unsigned>> parts;  ///< indices into `all`, by mesh of the file
};

/// The nodes of the scene that have triangles, in document order. `worldFromRoot` is applied after
/// the roots' own transforms. Transforms that glTF does not allow and nodes that are listed several
/// times are reported. The transforms of all nodes are added to `transforms`, unless it is null.
/// `tree` must be valid: validateNodeGraph().
std::vector<ImportedNode> collectGltfNodes(const GltfNodeTree& tree, const GltfMeshes& meshes,
                                           const Eigen::Affine3d& worldFromRoot,
                                           std::vector<Diagnostic>& diagnostics,
                                           NodeTransforms* transforms);

}  // namespace enfilade::scene
