// Reads the node transforms of a glTF file in doubles. assimp rounds them to floats, which is half
// a metre at five thousand kilometres. This reader parses the JSON again and matches its tree to
// assimp's.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "scene/model/model.hpp"

struct aiNode;
struct aiScene;

namespace enfilade::scene {

/// A node with the glTF file's own double-precision transform; assimp rounds it to floats.
struct GltfNode {
  Eigen::Affine3d parentFromNode;
  std::size_t index;                        ///< index into the file's list of nodes
  std::vector<ObjectAttribute> attributes;  ///< extras whose names begin with "_"
};
using GltfNodes = std::unordered_map<const aiNode*, GltfNode>;

/// The transform of a node of the file's JSON, in doubles.
struct StatedTransform {
  Eigen::Affine3d parentFromNode = Eigen::Affine3d::Identity();
  const char* fault = nullptr;  ///< what glTF does not allow in it and was ignored; null: nothing
  double rotationLength = 1;    ///< of the stated quaternion, which is normalised
};

StatedTransform readNodeTransform(const nlohmann::json& node);

/// Reads the nodes of a glTF file's JSON in doubles. Nodes without a matching assimp node are left
/// out and reported, as are transforms that glTF does not allow.
GltfNodes readGltfNodes(const aiScene& scene, const std::string& gltfJson,
                        std::vector<Diagnostic>& diagnostics);

/// The path and world transform of a glTF node.
struct NodeTransform {
  std::string path;                        ///< of its object, if it has meshes
  Eigen::Affine3d worldFromNode;           ///< metres, Y up, offset not yet removed
  std::optional<std::size_t> parentIndex;  ///< index of the parent node
};
using NodeTransforms = std::map<std::size_t, NodeTransform>;  ///< by node index

}  // namespace enfilade::scene
