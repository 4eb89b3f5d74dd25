// Reads the node transforms of a glTF file in doubles. assimp rounds them to floats, which is half
// a metre at five thousand kilometres. The nodes are read during the pre-pass's parse, and their
// tree is matched to assimp's.
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

/// The transform of a node of the file's JSON, in doubles.
struct StatedTransform {
  Eigen::Affine3d parentFromNode = Eigen::Affine3d::Identity();
  const char* fault = nullptr;  ///< what glTF does not allow in it and was ignored; null: nothing
  double rotationLength = 1;    ///< of the stated quaternion, which is normalised
};

StatedTransform readNodeTransform(const nlohmann::json& node);

/// The data that the import needs of a node of the JSON.
struct PlainNode {
  bool isObject = false;
  StatedTransform transform;
  std::vector<std::size_t> children;        ///< kNoIndex: not a number
  std::vector<ObjectAttribute> attributes;  ///< extras whose names begin with "_"
};

PlainNode readPlainNode(const nlohmann::json& json);
std::vector<std::size_t> readIndices(const nlohmann::json& list);  ///< kNoIndex: not a number

/// A node of the file that assimp read.
struct GltfNode {
  const PlainNode* plain;
  std::size_t index;  ///< into the file's list of nodes
};
using GltfNodes = std::unordered_map<const aiNode*, GltfNode>;

/// Matches the nodes of a file, below the roots of its scene, to assimp's. Nodes without a matching
/// assimp node are left out and reported, as are transforms that glTF does not allow. `nodes` must
/// outlive the result.
GltfNodes matchGltfNodes(const aiScene& scene, const std::vector<PlainNode>& nodes,
                         const std::vector<std::size_t>& roots,
                         std::vector<Diagnostic>& diagnostics);

/// The path and world transform of a glTF node.
struct NodeTransform {
  std::string path;                        ///< of its object, if it has meshes
  Eigen::Affine3d worldFromNode;           ///< metres, Y up, offset not yet removed
  std::optional<std::size_t> parentIndex;  ///< index of the parent node
};
using NodeTransforms = std::map<std::size_t, NodeTransform>;  ///< by node index

}  // namespace enfilade::scene
