// Octree (Lin 1993, section 5.3.1), in the loose form of Ulrich (Game Programming Gems, 2000).
//
// A node of edge e holds boxes of size at most e with centres in its cube. They stay inside the
// cube inflated by e/2, so a box is not kept at the root only because it crosses a middle plane.
// Nodes are created on first use. Movers are inserted again every tick in the same tree; their
// nodes stay.
#include <array>
#include <cmath>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

constexpr int kMaxLevels = 20;
constexpr double kMinEdge = 2;  // metres: about an avatar; smaller nodes only add visits

class LooseOctree : public BroadPhase {
 public:
  explicit LooseOctree(std::span<const Aabb> still) : still_(still) {
    Aabb whole;
    for (const Aabb& box : still) whole.include(box);
    rootCentre_ = whole.centre();
    rootEdge_ = whole.size().maxCoeff();
    nodes_.emplace_back();
    std::vector<std::uint32_t> nodeOfStill(still.size());
    for (std::uint32_t s = 0; s < still.size(); ++s) nodeOfStill[s] = nodeFor(still[s]);
    listStill(nodeOfStill);
  }

  void tick(std::span<const Aabb> movers, PairTally& tally) override {
    for (const std::uint32_t node : used_) nodes_[node].movers.clear();
    used_.clear();
    for (std::uint32_t id = 0; id < movers.size(); ++id) {
      ask(0, rootCentre_, rootEdge_, id, movers, tally);
      const std::uint32_t node = nodeFor(movers[id]);
      if (nodes_[node].movers.empty()) used_.push_back(node);
      nodes_[node].movers.push_back(id);
    }
  }

 private:
  struct Node {
    std::array<std::uint32_t, 8> child{};  ///< 0: no child
    std::uint32_t firstStill = 0, stillCount = 0;
    std::vector<std::uint32_t> movers;
  };

  /// Finds or creates the smallest node whose edge is at least the box's size. A box with its
  /// centre outside the root's cube stays at the root, which every query visits.
  std::uint32_t nodeFor(const Aabb& box) {
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

  void listStill(std::span<const std::uint32_t> nodeOfStill) {
    for (const std::uint32_t node : nodeOfStill) ++nodes_[node].stillCount;
    std::uint32_t next = 0;
    for (Node& node : nodes_) {
      node.firstStill = next;
      next += node.stillCount;
      node.stillCount = 0;
    }
    listed_.resize(next);
    for (std::uint32_t s = 0; s < nodeOfStill.size(); ++s) {
      Node& node = nodes_[nodeOfStill[s]];
      listed_[node.firstStill + node.stillCount++] = s;
    }
  }

  void ask(std::uint32_t index, const Vec3& centre, double edge, std::uint32_t id,
           std::span<const Aabb> movers, PairTally& tally) const {
    const Node& node = nodes_[index];
    const Aabb& box = movers[id];
    for (std::uint32_t k = node.firstStill; k < node.firstStill + node.stillCount; ++k) {
      if (collision::overlaps(box, still_[listed_[k]])) tally.addStill(id, listed_[k]);
    }
    for (const std::uint32_t other : node.movers) {
      if (collision::overlaps(box, movers[other])) tally.addMovers(id, other);
    }
    for (std::size_t octant = 0; octant < 8; ++octant) {
      if (node.child[octant] == 0) continue;
      const Vec3 at = centre + 0.25 * edge * getDirection(octant);
      // The child's loose bounds: its cube of edge/2, inflated by edge/4 on every side, and by
      // rounding.
      const Vec3 reach = Vec3::Constant(0.5001 * edge);
      if (collision::overlaps(box, {at - reach, at + reach})) {
        ask(node.child[octant], at, 0.5 * edge, id, movers, tally);
      }
    }
  }

  std::span<const Aabb> still_;
  Vec3 rootCentre_;
  double rootEdge_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> listed_;  ///< static boxes by node
  std::vector<std::uint32_t> used_;    ///< nodes that hold movers
};

}  // namespace

BroadPhaseMethod looseOctree() {
  return {"octree (loose)", BroadPhaseMethod::Kind::approach, SIZE_MAX, "", maker<LooseOctree>()};
}

}  // namespace enfilade::benchmarks
