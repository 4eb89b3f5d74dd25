// Reads the node transforms of a glTF file in doubles. assimp rounds them to floats, which is half
// a metre at five thousand kilometres. The nodes are read during the pre-pass's parse, and their
// tree is matched to assimp's.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
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

/// The data that the import needs of a node of the JSON.
struct PlainNode {
  bool isObject = false;
  StatedTransform transform;
  std::vector<std::size_t> children;  ///< kNoIndex: not a number
  std::vector<ObjectAttribute> attributes;
};

/// Reads the nodes of a file while it is parsed. A file may have a million nodes, so they are read
/// one by one, and their JSON is not kept.
class NodeReader {
 public:
  /// Call it for each event of nlohmann::json::parse() in order, and return its result from the
  /// callback: whether to keep a value that belongs to the nodes.
  bool see(int depth, nlohmann::json::parse_event_t event, const nlohmann::json& value);
  std::vector<PlainNode> takeNodes() { return std::move(nodes_); }

 private:
  std::vector<PlainNode> nodes_;
  bool inNodes_ = false;  ///< whether the list of nodes is being read
};

std::vector<std::size_t> readIndices(const nlohmann::json& list);  ///< kNoIndex: not a number

/// Matches the nodes of a file, below the roots of its scene, to assimp's. Nodes without a matching
/// assimp node are left out and reported, as are transforms that glTF does not allow.
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
