// QueryCount: counters of narrow-phase work.
#pragma once

#include <cstdint>

#include "collision/motion/shape_cast.hpp"

namespace enfilade::scene {

/// Narrow-phase work, for the tick's counters.
struct QueryCount {
  std::uint32_t narrow = 0;
  std::uint32_t rational = 0;
  std::uint32_t bounded = 0;        ///< casts that stopped at their iteration limit
  std::uint32_t partsLookedAt = 0;  ///< triangles and hulls in reach of queries

  void add(const collision::MotionResult& cast) {
    narrow += cast.queries;
    rational += cast.exactQueries;
    bounded += cast.outcome == collision::MotionOutcome::unproved ? 1 : 0;
  }
  void add(const QueryCount& other) {
    narrow += other.narrow;
    rational += other.rational;
    bounded += other.bounded;
    partsLookedAt += other.partsLookedAt;
  }
};

}  // namespace enfilade::scene
