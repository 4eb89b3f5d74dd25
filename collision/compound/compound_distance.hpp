// Distance query for two concave or articulated objects at any distance: the exact verdict and the
// two parts that attain it.
#pragma once

#include <functional>
#include <span>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/box_tree.hpp"

namespace enfilade::collision {

/// Non-owning view of convex parts under a box tree. An object consists of one or more views.
struct CompoundView {
  const BoxTree* tree = nullptr;
  Mat3 rotation = Mat3::Identity();  ///< worldFromTree
  Vec3 translation = Vec3::Zero();   ///< metres
  /// Maps an item of the tree to its part in the world frame.
  std::function<PlacedConvex(std::uint32_t)> part;
};

/// Conservative world box of all parts. The tree must not be empty.
Aabb computeAabb(const CompoundView& view);

struct NearestParts {
  enum class Outcome : std::uint8_t {
    nearest,         ///< `separation` of the parts `a` and `b`
    outOfRange,      ///< all parts are farther apart than the search distance
    budgetExhausted  ///< the budget was exhausted before the result was known
  };
  Outcome outcome = Outcome::outOfRange;
  SeparationResult
      separation;  ///< penetrating if any two parts are, else touching, else minimum distance
  PlacedConvex a, b;
};

/// Budget of a separation query on two parts. A test of two boxes costs 1.
inline constexpr std::size_t kSeparationCost = 16;

/// Finds the nearest pair of parts up to the distance `within` (metres, >= 0 or infinite). Parts
/// slightly farther apart may also be returned. Deducts its cost from `budget` and stops at 0.
NearestParts findNearestParts(std::span<const CompoundView> a, std::span<const CompoundView> b,
                              double within, std::size_t& budget);

}  // namespace enfilade::collision
