// Heights of storeys from weighted heights of feet or floors.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace enfilade::server {

/// A weighted height in metres, of feet or floors. `weight` > 0, in any unit.
struct WeightedHeight {
  double height = 0;
  double weight = 1;
};

/// Finds the heights with most weight: at most `maxCount`, ascending, at least two metres apart.
/// All but the first need at least `minShare` of the total weight.
std::vector<double> findStoreyHeights(std::span<const WeightedHeight> heights, double minShare,
                                      std::size_t maxCount);

}  // namespace enfilade::server
