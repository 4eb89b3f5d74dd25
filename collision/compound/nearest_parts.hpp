// Distance query for two concave or articulated objects at any distance: the exact verdict and the
// two parts that attain it.
#pragma once

#include <span>

#include "collision/compound/compound_view.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

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
