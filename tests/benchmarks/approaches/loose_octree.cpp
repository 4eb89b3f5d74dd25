// Octree (Lin 1993, section 5.3.1), in the loose form of Ulrich (Game Programming Gems, 2000).
//
// A node of edge e holds boxes of size at most e with centres in its cube. They stay inside the
// cube inflated by e/2, so a box is not kept at the root only because it crosses a middle plane.
// Nodes are created on first use. Dynamic boxes are inserted again every tick in the same tree;
// their nodes stay.
#include <array>
#include <cmath>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

constexpr int kMaxLevels = 20;
constexpr double kMinEdge = 2;  // metres: about an avatar; smaller nodes only add visits

class LooseOctree : public BroadPhase {
 public:
  explicit LooseOctree(std::span<const Aabb> staticBoxes) : staticBoxes_(staticBoxes) {
    Aabb whole;
    for (const Aabb& box : staticBoxes) whole.include(box);
    rootCentre_ = whole.centre();
    rootEdge_ = whole.size().maxCoeff();
    nodes_.emplace_back();
    std::vector<std::uint32_t> nodeOfStatic(staticBoxes.size());
    for (std::uint32_t s = 0; s < staticBoxes.size(); ++s)
      nodeOfStatic[s] = findOrCreateNode(staticBoxes[s]);
    listStatic(nodeOfStatic);
  }

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    for (const std::uint32_t node : used_) nodes_[node].dynamicBoxes.clear();
    used_.clear();
    for (std::uint32_t id = 0; id < dynamicBoxes.size(); ++id) {
      ask(0, rootCentre_, rootEdge_, id, dynamicBoxes, tally);
      const std::uint32_t node = findOrCreateNode(dynamicBoxes[id]);
      if (nodes_[node].dynamicBoxes.empty()) used_.push_back(node);
      nodes_[node].dynamicBoxes.push_back(id);
    }
  }

 private:
  struct Node {
    std::array<std::uint32_t, 8> child{};  ///< 0: no child
    std::uint32_t firstStatic = 0, staticCount = 0;
    std::vector<std::uint32_t> dynamicBoxes;
  };

  /// Finds or creates the smallest node whose edge is at least the box's size. A box with its
  /// centre outside the root's cube stays at the root, which every query visits.
  std::uint32_t findOrCreateNode(const Aabb& box) {
    const double size = std::max(box.size().maxCoeff(), kMinEdge);
    const Vec3 at = box.centre();
    Vec3 centre = rootCentre_;
    double edge = rootEdge_;
    std::uint32_t node = 0;
    if (((at - centre).array().abs() > 0.5 * edge).any()) return 0;
    for (int level = 0; level < kMaxLevels && 0.5 * edge >= size; ++level) {
      const std::size_t octant = getOctant(at, centre);
      centre += 0.25 * edge * getDirection(octant);
      edge *= 0.5;
      if (nodes_[node].child[octant] == 0) {
        nodes_[node].child[octant] = static_cast<std::uint32_t>(nodes_.size());
        nodes_.emplace_back();
      }
      node = nodes_[node].child[octant];
    }
    return node;
  }

  static std::size_t getOctant(const Vec3& at, const Vec3& centre) {
    return (at.x() > centre.x() ? 1u : 0u) + (at.y() > centre.y() ? 2u : 0u) +
           (at.z() > centre.z() ? 4u : 0u);
  }
  static Vec3 getDirection(std::size_t octant) {
    return {octant & 1 ? 1.0 : -1.0, octant & 2 ? 1.0 : -1.0, octant & 4 ? 1.0 : -1.0};
  }

  void listStatic(std::span<const std::uint32_t> nodeOfStatic) {
    for (const std::uint32_t node : nodeOfStatic) ++nodes_[node].staticCount;
    std::uint32_t next = 0;
    for (Node& node : nodes_) {
      node.firstStatic = next;
      next += node.staticCount;
      node.staticCount = 0;
    }
    listed_.resize(next);
    for (std::uint32_t s = 0; s < nodeOfStatic.size(); ++s) {
      Node& node = nodes_[nodeOfStatic[s]];
      listed_[node.firstStatic + node.staticCount++] = s;
    }
  }

  void ask(std::uint32_t index, const Vec3& centre, double edge, std::uint32_t id,
           std::span<const Aabb> dynamicBoxes, PairTally& tally) const {
    const Node& node = nodes_[index];
    const Aabb& box = dynamicBoxes[id];
    for (std::uint32_t k = node.firstStatic; k < node.firstStatic + node.staticCount; ++k) {
      if (collision::overlaps(box, staticBoxes_[listed_[k]])) tally.addStaticPair(id, listed_[k]);
    }
    for (const std::uint32_t other : node.dynamicBoxes) {
      if (collision::overlaps(box, dynamicBoxes[other])) tally.addDynamicPair(id, other);
    }
    for (std::size_t octant = 0; octant < 8; ++octant) {
      if (node.child[octant] == 0) continue;
      const Vec3 at = centre + 0.25 * edge * getDirection(octant);
      // The child's loose bounds: its cube of edge/2, inflated by edge/4 on every side, and by
      // rounding.
      const Vec3 reach = Vec3::Constant(0.5001 * edge);
      if (collision::overlaps(box, {at - reach, at + reach})) {
        ask(node.child[octant], at, 0.5 * edge, id, dynamicBoxes, tally);
      }
    }
  }

  std::span<const Aabb> staticBoxes_;
  Vec3 rootCentre_;
  double rootEdge_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> listed_;  ///< static boxes by node
  std::vector<std::uint32_t> used_;    ///< nodes that hold dynamic boxes
};

}  // namespace

BroadPhaseMethod makeLooseOctree() {
  return {"octree (loose)", BroadPhaseMethod::Kind::approach, SIZE_MAX, "",
          bindMaker<LooseOctree>()};
}

}  // namespace enfilade::benchmarks
