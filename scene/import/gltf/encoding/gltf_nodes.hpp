// The nodes of a glTF file. Their transforms are in doubles: assimp would round them to floats,
// which is half a metre at five thousand kilometres.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// The transform of a node of the file's JSON, in doubles.
struct StatedTransform {
  Eigen::Affine3d parentFromNode = Eigen::Affine3d::Identity();
  const char* fault = nullptr;  ///< what glTF does not allow in it and was ignored; null: nothing
  double rotationLength = 1;    ///< of the stated quaternion, which is normalised
};

StatedTransform readNodeTransform(const nlohmann::json& node);

/// The data that the import needs of a node of the JSON. An index that is not a number is larger
/// than any list.
struct PlainNode {
  bool isObject = false;
  std::string name;  ///< at most 1,023 bytes, to bound the lengths of paths
  StatedTransform transform;
  std::vector<std::size_t> children;
  std::optional<std::size_t> mesh, camera;
  std::vector<ObjectAttribute> attributes;  ///< extras whose names begin with "_"
};

PlainNode readPlainNode(const nlohmann::json& json);
/// The indices of a member that is a list; kNoIndex for what is no index, and for a member that is
/// no list.
std::vector<std::size_t> readIndices(const nlohmann::json& owner, const char* key);
/// Cut to kMaxNameBytes.
std::string readEntryName(const nlohmann::json& entry);

/// "nodes[3] 'door'"
/// Cut to kMaxNameBytes.
std::string readEntryName(const nlohmann::json& entry);

/// "nodes[3] 'door'"
std::string describeEntry(const char* section, std::size_t index, const std::string& name);
std::string describeNode(const PlainNode& node, std::size_t index);

/// The nodes of a file and the scene that is read.
struct GltfNodeTree {
  std::vector<PlainNode> nodes;    ///< all, by index
  std::vector<std::size_t> roots;  ///< of the scene; indices of nodes
};

/// The nodes of the scene, each once, after all below it. Indices that do not exist are left out.
std::vector<std::size_t> listSceneNodes(const GltfNodeTree& tree);

/// The path and world transform of a glTF node.
struct NodeTransform {
  std::string path;                        ///< of its object, if it has meshes
  Eigen::Affine3d worldFromNode;           ///< metres, Y up, offset not yet removed
  std::optional<std::size_t> parentIndex;  ///< index of the parent node
};
using NodeTransforms = std::map<std::size_t, NodeTransform>;  ///< by node index

}  // namespace enfilade::scene
