// Concave and articulated objects as convex parts and triangles under trees of boxes (seed 5.2.1):
// which parts of two such objects may meet, and the verdict on the whole.
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

/// The parts of one rigid piece, in its own frame, metres. The tree over them is built when it is
/// first opened; safe to share between threads.
class PartTree {
 public:
  /// Convex parts; none may be empty.
  explicit PartTree(std::vector<Hull> hulls);
  /// Each triangle is a part: closed, without thickness.
  explicit PartTree(std::vector<Triangle> triangles);
  ~PartTree();
  PartTree(PartTree&&) noexcept;

  std::uint32_t size() const;
  std::span<const Vec3> vertices(std::uint32_t part) const;
  /// Null for triangles.
  const Hull* hull(std::uint32_t part) const;
  /// Of all parts.
  const Box& box() const { return box_; }
  /// Greatest distance of a vertex from the origin of the frame.
  double radius() const { return radius_; }

  /// The boxes over the parts. Branch 0 is the root, branches 2k + 1 and 2k + 2 are the children of
  /// node k.
  struct Opened {
    BoxTree boxes;
    std::vector<std::uint32_t> branchOfNode;
    const BoxTree::Branch& branch(std::uint32_t i) const {
      return i == 0 ? boxes.root : boxes.nodes[(i - 1) / 2].children[(i - 1) % 2];
    }
  };
  const Opened& opened() const;
  /// Whether anything has needed the tree yet.
  bool isOpened() const;

 private:
  struct Lazy;
  std::vector<Hull> hulls_;
  std::vector<Triangle> triangles_;
  Box box_;
  double radius_ = 0;
  std::unique_ptr<Lazy> lazy_;
};

/// A rigid piece where it stands. A rigid object is one of these; an articulated one is one for
/// each link. As for ConvexBody, the doubles are taken as they are.
struct PlacedParts {
  const PartTree* parts = nullptr;
  Mat3 rotation = Mat3::Identity();  ///< worldFromPiece
  Vec3 translation = Vec3::Zero();   ///< metres
};

/// The box of one placed part in the world: never smaller than the exact one.
Box boxOf(const PlacedParts& placed, std::uint32_t part);

struct PartPair {
  std::uint32_t linkA = 0, partA = 0, linkB = 0, partB = 0;
  auto operator<=>(const PartPair&) const = default;
};

/// What is kept from tick to tick of two objects. Call reset() before it serves other objects (or
/// other parts); the poses may be any.
struct PartsCache {
  /// Two branches at which the last descent ended, in the order of the descent.
  struct FrontPair {
    std::uint32_t a, b;
    bool apart;
  };
  /// World boxes of one link's branches, made when first asked for in a tick.
  struct LinkBoxes {
    std::vector<Box> boxes;
    std::vector<std::uint64_t> madeAt;
  };
  std::vector<std::vector<FrontPair>> fronts;  ///< of each pair of links
  std::vector<LinkBoxes> boxesA, boxesB;
  std::vector<PartPair> pairs;         ///< ascending
  std::vector<FeatureCache> features;  ///< of `pairs`
  PartPair decisive;                   ///< decided the last verdict
  std::uint64_t tick = 0;
  std::uint64_t boxTests = 0, boxesMade = 0, decisions = 0;  ///< counters

  void reset() { *this = PartsCache{}; }
};

/// Exactly the pairs of parts whose boxes, those of A grown by `clearance` (metres, >= 0), overlap;
/// ascending. The list lives in the cache.
const std::vector<PartPair>& overlappingParts(std::span<const PlacedParts> a,
                                              std::span<const PlacedParts> b, double clearance,
                                              PartsCache& cache);

/// The verdict on two whole objects: penetrating if any two parts penetrate, else touching if any
/// touch, else separated with the least distance.
struct PartsDecision {
  PartPair pair;      ///< that attains it
  Decision decision;  ///< of that pair
};

/// nullopt: all parts are proved farther apart than `clearance`.
std::optional<PartsDecision> decideParts(std::span<const PlacedParts> a,
                                         std::span<const PlacedParts> b, double clearance,
                                         PartsCache& cache);

}  // namespace enfilade::collision
