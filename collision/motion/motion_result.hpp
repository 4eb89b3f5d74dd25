// The result of every proof about a motion: shape casts, motions between two poses, and the time of
// impact.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

enum class MotionOutcome : std::uint8_t {
  clear,    ///< proved: the whole motion is free; lo = hi = its end
  contact,  ///< the motion is free up to `lo` and meets the other body by `hi`
  unproved  ///< free up to `lo`, where a limit ended the search; unknown from there to `hi`
};

struct MotionResult {
  MotionOutcome outcome = MotionOutcome::clear;
  std::uint32_t queries = 0;       ///< number of narrow-phase queries
  std::uint32_t exactQueries = 0;  ///< number of queries decided by rational arithmetic
  /// Fractions of the motion, 0..1; seconds for a time of impact.
  double lo = 1, hi = 1;
  SeparationResult separation = {};  ///< normal from A to B; the functions say of which position

  bool isClear() const { return outcome == MotionOutcome::clear; }
  void countQuery(Certificate certificate) {
    ++queries;
    if (certificate == Certificate::rational) ++exactQueries;
  }
};

}  // namespace enfilade::collision
