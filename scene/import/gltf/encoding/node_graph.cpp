// A depth-first search gives an order with parents before their children. One pass in this order
// adds up, from parents to children, at how many places each node stands. It throws at a limit, so
// no sum overflows.
#include "scene/import/gltf/encoding/node_graph.hpp"

#include <algorithm>

#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/encoding/gltf_json.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

// Limits of what nodes that are listed several times may add to a scene. A node that is listed once
// has none here: the file contains it.
constexpr std::uint64_t kMaxCopies = 1'000'000;               // of nodes; imported in 15 s, 3 GB
constexpr std::uint64_t kMaxCopiedPathBytes = 500'000'000;    // of the paths of their objects
constexpr std::uint64_t kMaxCopiedTriangles = 4'000'000'000;  // imported in 15 s

/// Of the path of an object: a separator, and a number that makes the name unique.
constexpr std::size_t kSegmentBytes = 8;
constexpr std::size_t kMaxNameBytes = 1023;  // of a node; assimp cuts off the rest

}  // namespace

// ---- reading ------------------------------------------------------------------------------------

void NodeGraph::seeKey(std::size_t depth, const std::string& key) {
  if (depth == 1) {
    inNodes_ = key == "nodes";
    if (inNodes_) nodes_.clear();  // of several lists, the last counts
  }
  if (!inNodes_ || depth != 3) return;
  member_ = key;
  inChildren_ = false;
}

void NodeGraph::seeStart(std::size_t depth, bool isArray) {
  if (!inNodes_) return;
  if (depth == 2) {
    nodes_.emplace_back();
    member_.clear();
  } else if (depth == 3 && isArray && member_ == "children") {
    inChildren_ = true;
    nodes_.back().firstChild = children_.size();
    nodes_.back().childCount = 0;
  }
}

void NodeGraph::seeValue(std::size_t depth, const Json& value) {
  if (!inNodes_) return;
  if (depth == 2) nodes_.emplace_back();  // no object, but it counts for the indices
  if (depth == 4 && inChildren_ && value.is_number_unsigned()) {
    children_.push_back(value.get<std::size_t>());
    ++nodes_.back().childCount;
  }
  if (depth != 3) return;
  if (member_ == "mesh" && value.is_number_unsigned())
    nodes_.back().mesh = value.get<std::size_t>();
  if (member_ == "name" && value.is_string())
    nodes_.back().nameBytes = std::min(value.get_ref<const std::string&>().size(), kMaxNameBytes);
}

// ---- counting -----------------------------------------------------------------------------------

/// Walks the nodes of one scene and then all others.
class CopyCounter {
 public:
  CopyCounter(const NodeGraph& graph, const std::vector<std::size_t>& trianglesByMesh,
              const std::filesystem::path& file)
      : nodes_(graph.nodes_),
        children_(graph.children_),
        trianglesByMesh_(trianglesByMesh),
        file_(file.string()),
        tallies_(nodes_.size()) {}

  void run(const Json& roots) {
    for (const Json& index : roots) {
      const std::size_t root = index.is_number_unsigned() ? index.get<std::size_t>() : kNoIndex;
      if (root >= nodes_.size()) continue;
      ++tallies_[root].places;
      ++tallies_[root].listings;
      search(root);
    }
    for (std::size_t node = 0; node < nodes_.size(); ++node) search(node);
    for (std::size_t i = finished_.size(); i-- > 0;) count(finished_[i]);
  }

 private:
  struct Tally {
    std::uint64_t places = 0;       ///< at which the node stands in the scene
    std::uint64_t pathBytes = 0;    ///< at all of them
    std::uint64_t firstBytes = 0;   ///< of the path at the place that was found first
    std::size_t listings = 0;       ///< by nodes of the scene, and as its root
    std::size_t parent = kNoIndex;  ///< at the place that was found first
    std::size_t finish = kNoIndex;  ///< in finished_
    std::size_t depth = 0;          ///< the largest; that of roots is 0
    bool isFound = false;
  };

  /// Depth-first, in the order of assimp, which does not look below a node twice either.
  void search(std::size_t start) {
    if (tallies_[start].isFound) return;
    tallies_[start].isFound = true;
    open_.push_back({start, 0});
    while (!open_.empty()) {
      const std::size_t node = open_.back().node;
      if (open_.back().nextChild == nodes_[node].childCount) {
        tallies_[node].finish = finished_.size();
        finished_.push_back(node);
        open_.pop_back();
        continue;
      }
      const std::size_t child = children_[nodes_[node].firstChild + open_.back().nextChild++];
      if (child >= nodes_.size() || tallies_[child].isFound) continue;
      tallies_[child].isFound = true;
      tallies_[child].parent = node;
      open_.push_back({child, 0});
    }
  }

  /// Adds a node's copies, and passes its sums on to its children. All its parents were counted.
  void count(std::size_t node) {
    Tally& tally = tallies_[node];
    if (tally.depth > static_cast<std::size_t>(kMaxNodeDepth)) refuseDeepNodes(file_ + ": ");
    if (tally.places > 1) {
      copies_ += tally.places - 1;
      limit(node, copies_, kMaxCopies, "copied nodes");
    }
    const std::size_t bytes = nodes_[node].nameBytes + kSegmentBytes;
    tally.pathBytes += tally.places * bytes;
    tally.firstBytes = bytes + (tally.parent == kNoIndex ? 0 : tallies_[tally.parent].firstBytes);
    if (tally.places > 1) {
      limit(node, copiedPathBytes_ += tally.pathBytes - tally.firstBytes, kMaxCopiedPathBytes,
            "bytes of copied paths");
      limit(node, copiedTriangles_ += (tally.places - 1) * countTriangles(node),
            kMaxCopiedTriangles, "copied triangles");
    }
    for (std::size_t i = 0; i < nodes_[node].childCount; ++i) {
      const std::size_t index = children_[nodes_[node].firstChild + i];
      if (index >= nodes_.size()) continue;
      Tally& child = tallies_[index];
      if (child.finish >= tally.finish) continue;  // it closes a circle
      child.places += tally.places;
      child.pathBytes += tally.pathBytes;
      child.depth = std::max(child.depth, tally.depth + 1);
      if (tally.places > 0) ++child.listings;
    }
  }

  /// Of a node's mesh, at most one more than the limit.
  std::uint64_t countTriangles(std::size_t node) const {
    const std::optional<std::size_t>& mesh = nodes_[node].mesh;
    if (!mesh || *mesh >= trianglesByMesh_.size()) return 0;
    return std::min<std::uint64_t>(trianglesByMesh_[*mesh], kMaxCopiedTriangles + 1);
  }

  /// `node` stands at several places, so it or a node above it is listed several times.
  void limit(std::size_t node, std::uint64_t value, std::uint64_t most, const char* what) const {
    if (value <= most) return;
    while (tallies_[node].listings == 1 && tallies_[node].parent != kNoIndex)
      node = tallies_[node].parent;
    throw ImportError(file_ + ": nodes that are listed several times, such as nodes[" +
                      std::to_string(node) + "], make more than " + std::to_string(most) + " " +
                      what + "; list each node once and share meshes, or export it again");
  }

  struct OpenNode {
    std::size_t node, nextChild;
  };

  const std::vector<NodeGraph::Node>& nodes_;
  const std::vector<std::size_t>& children_;
  const std::vector<std::size_t>& trianglesByMesh_;
  std::string file_;
  std::vector<Tally> tallies_;         // by node
  std::vector<std::size_t> finished_;  // nodes, each after all below it
  std::vector<OpenNode> open_;
  std::uint64_t copies_ = 0, copiedPathBytes_ = 0, copiedTriangles_ = 0;
};

void NodeGraph::check(const Json& roots, const std::vector<std::size_t>& trianglesByMesh,
                      const std::filesystem::path& file) const {
  CopyCounter(*this, trianglesByMesh, file).run(roots);
}

}  // namespace enfilade::scene
