// The tree of a glTF file's nodes: its depth, and what it copies. glTF allows each node one parent,
// but assimp reads a node that is listed several times, and copies it and all below to each place.
// So a few kilobytes of JSON can mean more nodes than fit into memory. Private to the import.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace enfilade::scene {

class NodeGraph {
 public:
  /// Call these for each key, value and begin of a container in order. `depth`: of open containers.
  void seeKey(std::size_t depth, const std::string& key);
  void seeValue(std::size_t depth, const nlohmann::json& value);  ///< one that is no container
  void seeStart(std::size_t depth, bool isArray);

  /// Throws ImportError for nodes that are nested deeper than kMaxNodeDepth, read or not, because
  /// assimp reads also those that are animated; and for too many copies in the scene with these
  /// root nodes. Circles are left to assimp, which refuses them.
  void check(const nlohmann::json& roots, const std::vector<std::size_t>& trianglesByMesh,
             const std::filesystem::path& file) const;

 private:
  struct Node {
    std::size_t firstChild = 0, childCount = 0;  ///< in children_
    std::optional<std::size_t> mesh;
    std::size_t nameBytes = 0;
  };
  friend class CopyCounter;

  std::vector<Node> nodes_;
  std::vector<std::size_t> children_;  ///< of all nodes; indices that do not exist included
  bool inNodes_ = false;               ///< whether the list of nodes is being read
  std::string member_;                 ///< key of the node that is being read
  bool inChildren_ = false;            ///< whether the member is a list of children
};

}  // namespace enfilade::scene
