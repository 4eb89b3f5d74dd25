// The rest pose of skinned and morphed glTF meshes (glTF 2.0, 3.7.2.2 and 3.7.3). Skins have the
// joints where the file's nodes put them, and morph targets have their default weights. Private to
// the import.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/import/gltf/gltf_buffers.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

struct RestPose {
  std::size_t mesh = 0;                        ///< the mesh of the file that has this pose
  std::vector<double> morphWeights;            ///< by morph target
  std::vector<Eigen::Affine3d> nodeFromJoint;  ///< by joint: from the mesh as bound to the node
};

/// Float arrays of a primitive, by attribute.
using PrimitiveArrays = std::map<std::string, std::vector<float>>;

/// Gives each node with a skin or with morph weights a mesh of its own. Returns the poses of these
/// meshes by their index. Throws ImportError.
std::map<std::size_t, RestPose> separatePosedMeshes(nlohmann::json& gltf, GltfBuffers& buffers,
                                                    std::vector<Diagnostic>& problems);

/// Adds morph targets times their weights. `targets`: of the primitive.
void applyMorphTargets(const RestPose& pose, const nlohmann::json& targets, GltfBuffers& buffers,
                       const std::string& name, PrimitiveArrays& arrays);

/// Moves positions and normals with the joints; `arrays` holds JOINTS_n and WEIGHTS_n, too.
void applySkin(const RestPose& pose, GltfBuffers& buffers, const std::string& name,
               PrimitiveArrays& arrays);

/// The box of all places where the skin can put a point of `box`. It contains the corners after
/// each joint that moves a vertex of the primitive. Needs the skin's joints and the primitive's
/// weights, but not its positions. Throws ImportError if they cannot be read.
Aabb computePosedBox(const RestPose& pose, const Aabb& box, const nlohmann::json& primitive,
                     GltfBuffers& buffers, const std::string& name);

}  // namespace enfilade::scene
