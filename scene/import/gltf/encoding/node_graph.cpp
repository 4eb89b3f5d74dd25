// The reverse of a depth-first search's order has parents before their children. One pass in this
// order adds up, from parents to children, at how many places each node stands. It throws at a
// limit, so no sum overflows.
#include "scene/import/gltf/encoding/node_graph.hpp"

#include <algorithm>
#include <cstdint>
#include <string>

#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/encoding/gltf_json.hpp"

namespace enfilade::scene {
namespace {

// Limits of what nodes that are listed several times may add to a scene. A node that is listed once
// has none here: the file contains it.
constexpr std::uint64_t kMaxCopies = 1'000'000;               // of nodes; imported in 4 s, 1.2 GB
constexpr std::uint64_t kMaxCopiedPathBytes = 500'000'000;    // of the paths of their objects
constexpr std::uint64_t kMaxCopiedTriangles = 4'000'000'000;  // imported in 4 s

/// Of the path of an object: a separator, and a number that makes the name unique.
constexpr std::size_t kSegmentBytes = 8;

/// Walks the nodes of the scene.
class CopyCounter {
 public:
  CopyCounter(const GltfNodeTree& tree, const std::vector<std::size_t>& trianglesByMesh,
              const std::filesystem::path& file)
      : tree_(tree),
        trianglesByMesh_(trianglesByMesh),
        file_(file.string() + ": "),
        tallies_(tree.nodes.size()) {}

  void run() {
    for (const std::size_t root : tree_.roots) {
      if (root >= tallies_.size()) continue;
      ++tallies_[root].places;
      ++tallies_[root].listings;
    }
    const std::vector<std::size_t> order = listSceneNodes(tree_);
    for (std::size_t i = 0; i < order.size(); ++i) tallies_[order[i]].finish = i;
    for (std::size_t i = order.size(); i-- > 0;) count(order[i]);
  }

 private:
  struct Tally {
    std::uint64_t places = 0;       ///< at which the node stands in the scene
    std::uint64_t pathBytes = 0;    ///< at all of them
    std::uint64_t firstBytes = 0;   ///< of the path below `parent`
    std::size_t listings = 0;       ///< by nodes of the scene, and as its root
    std::size_t parent = kNoIndex;  ///< one of them
    std::size_t finish = 0;         ///< the place in the order of the search
    std::size_t depth = 0;          ///< the largest; that of roots is 0
  };

  /// Adds a node's copies, and passes its sums on to its children. All its parents were counted.
  void count(std::size_t node) {
    Tally& tally = tallies_[node];
    if (tally.depth > static_cast<std::size_t>(kMaxNodeDepth)) refuseDeepNodes(file_);
    if (tally.places > 1) {
      copies_ += tally.places - 1;
      limit(node, copies_, kMaxCopies, "copied nodes");
    }
    const PlainNode& plain = tree_.nodes[node];
    if (!plain.isObject)
      throw ImportError(file_ + describeNode(plain, node) + " is not an object; export it again");
    const std::size_t bytes = plain.name.size() + kSegmentBytes;
    tally.pathBytes += tally.places * bytes;
    tally.firstBytes = bytes + (tally.parent == kNoIndex ? 0 : tallies_[tally.parent].firstBytes);
    if (tally.places > 1) {
      limit(node, copiedPathBytes_ += tally.pathBytes - tally.firstBytes, kMaxCopiedPathBytes,
            "bytes of copied paths");
      limit(node, copiedTriangles_ += (tally.places - 1) * countTriangles(plain),
            kMaxCopiedTriangles, "copied triangles");
    }
    for (const std::size_t index : plain.children) {
      if (index >= tallies_.size()) continue;
      Tally& child = tallies_[index];
      if (child.finish >= tally.finish)
        throw ImportError(file_ + describeNode(tree_.nodes[index], index) +
                          " stands below itself; export it again");
      if (child.listings++ == 0) child.parent = node;
      child.places += tally.places;
      child.pathBytes += tally.pathBytes;
      child.depth = std::max(child.depth, tally.depth + 1);
    }
  }

  /// Of a node's mesh, at most one more than the limit.
  std::uint64_t countTriangles(const PlainNode& node) const {
    if (!node.mesh || *node.mesh >= trianglesByMesh_.size()) return 0;
    return std::min<std::uint64_t>(trianglesByMesh_[*node.mesh], kMaxCopiedTriangles + 1);
  }

  /// `node` stands at several places, so it or a node above it is listed several times.
  void limit(std::size_t node, std::uint64_t value, std::uint64_t maxValue,
             const char* what) const {
    if (value <= maxValue) return;
    while (tallies_[node].listings == 1 && tallies_[node].parent != kNoIndex)
      node = tallies_[node].parent;
    throw ImportError(file_ + "nodes that are listed several times, such as nodes[" +
                      std::to_string(node) + "], make more than " + std::to_string(maxValue) + " " +
                      what + "; list each node once and share meshes, or export it again");
  }

  const GltfNodeTree& tree_;
  const std::vector<std::size_t>& trianglesByMesh_;
  std::string file_;            ///< its name and ": "
  std::vector<Tally> tallies_;  // by node
  std::uint64_t copies_ = 0, copiedPathBytes_ = 0, copiedTriangles_ = 0;
};

}  // namespace

void validateNodeGraph(const GltfNodeTree& tree, const std::vector<std::size_t>& trianglesByMesh,
                       const std::filesystem::path& file) {
  CopyCounter(tree, trianglesByMesh, file).run();
}

}  // namespace enfilade::scene
