// Pairs of dynamic boxes by one sort and sweep along x, for approaches that handle only the static
// scene.
#pragma once

#include <algorithm>
#include <numeric>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {

class DynamicSweep {
 public:
  void reportPairs(std::span<const Aabb> dynamicBoxes, PairTally& tally) {
    if (order_.size() != dynamicBoxes.size()) {
      order_.resize(dynamicBoxes.size());
      std::iota(order_.begin(), order_.end(), 0u);
    }
    std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return dynamicBoxes[a].min.x() < dynamicBoxes[b].min.x();
    });
    for (std::size_t i = 0; i < order_.size(); ++i) {
      const Aabb& box = dynamicBoxes[order_[i]];
      for (std::size_t k = i + 1; k < order_.size(); ++k) {
        const Aabb& other = dynamicBoxes[order_[k]];
        if (other.min.x() > box.max.x()) break;
        if (collision::overlaps(box, other)) tally.addDynamicPair(order_[i], order_[k]);
      }
    }
  }

 private:
  std::vector<std::uint32_t> order_;  ///< the last tick's order, nearly sorted
};

}  // namespace enfilade::benchmarks
