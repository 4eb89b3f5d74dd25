// Compound shapes: concave and articulated objects as convex parts or triangles under box trees
// (Lin 1993, section 5.2.1). Queries find the overlapping parts of two objects, and their verdict.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/box_tree.hpp"
#include "collision/shapes/hull.hpp"
#include "collision/shapes/triangle_tree.hpp"

namespace enfilade::collision {

/// Parts of one rigid piece, in its own frame, metres. The tree is built at the first call of
/// bvh(). Const functions are thread-safe.
class CompoundShape {
 public:
  /// Convex parts. No hull may be empty.
  explicit CompoundShape(std::vector<Hull> hulls);
  /// Each triangle is a closed part without thickness.
  explicit CompoundShape(std::vector<Triangle> triangles);
  ~CompoundShape();
  CompoundShape(CompoundShape&&) noexcept;

  std::uint32_t size() const;
  std::span<const Vec3> vertices(std::uint32_t part) const;
  /// Null for triangles.
  const Hull* hull(std::uint32_t part) const;
  /// Bounding box of all parts.
  const Aabb& box() const { return box_; }
  /// Maximum distance of a vertex from the origin of the frame, metres.
  double radius() const { return radius_; }

  /// Bounding volume hierarchy of the parts. Branch 0 is the root; branches 2k + 1 and 2k + 2 are
  /// the children of node k.
  struct Bvh {
    BoxTree tree;
    std::vector<std::uint32_t> branchOfNode;
    const BoxTree::Branch& branch(std::uint32_t i) const {
      return i == 0 ? tree.root : tree.nodes[(i - 1) / 2].children[(i - 1) % 2];
    }
  };
  const Bvh& bvh() const;
  /// True if the tree has been built.
  bool isBvhBuilt() const;

 private:
  struct LazyBvh;
  std::vector<Hull> hulls_;
  std::vector<Triangle> triangles_;
  Aabb box_;
  double radius_ = 0;
  std::unique_ptr<LazyBvh> lazy_;
};

/// Compound shape at a pose. A rigid object is one of these, an articulated object one per link.
/// As for PlacedConvex, the doubles are taken as exact.
struct PlacedCompound {
  const CompoundShape* shape = nullptr;
  Mat3 rotation = Mat3::Identity();  ///< worldFromPiece
  Vec3 translation = Vec3::Zero();   ///< metres
};

/// Conservative world box of one placed part.
Aabb computeAabb(const PlacedCompound& placed, std::uint32_t part);

struct PartPair {
  std::uint32_t linkA = 0, partA = 0, linkB = 0, partB = 0;
  auto operator<=>(const PartPair&) const = default;
};

/// State of a pair of objects that is kept from tick to tick. Call reset() before use with other
/// objects or parts. Poses may change arbitrarily.
struct CompoundCache {
  /// Two branches at which the last traversal ended, in traversal order.
  struct BvttFrontEntry {
    std::uint32_t a, b;
    bool separated;
  };
  /// World boxes of the branches of one link, computed on demand once per tick.
  struct LinkAabbs {
    std::vector<Aabb> boxes;
    std::vector<std::uint64_t> computedAt;
  };
  std::vector<std::vector<BvttFrontEntry>> fronts;  ///< one per pair of links
  std::vector<LinkAabbs> boxesA, boxesB;
  std::vector<PartPair> pairs;         ///< ascending
  std::vector<FeatureCache> features;  ///< of `pairs`
  PartPair witnessPair;                ///< pair of the last verdict
  std::uint64_t tick = 0;
  std::uint64_t aabbTests = 0, aabbsComputed = 0, separationQueries = 0;  ///< counters

  void reset() { *this = CompoundCache{}; }
};

/// Finds exactly the pairs of parts whose boxes overlap, those of A inflated by `clearance`
/// (metres, >= 0). Ascending. The cache owns the list.
const std::vector<PartPair>& findOverlappingParts(std::span<const PlacedCompound> a,
                                                  std::span<const PlacedCompound> b,
                                                  double clearance, CompoundCache& cache);

/// Verdict on two objects: penetrating if any two parts penetrate, else touching if any touch, else
/// separated with the minimum distance.
struct CompoundSeparation {
  PartPair pair;                ///< pair that attains it
  SeparationResult separation;  ///< of that pair
};

/// Computes the verdict. nullopt: all parts are proved farther apart than `clearance` (metres).
std::optional<CompoundSeparation> computeCompoundSeparation(std::span<const PlacedCompound> a,
                                                            std::span<const PlacedCompound> b,
                                                            double clearance, CompoundCache& cache);

}  // namespace enfilade::collision
