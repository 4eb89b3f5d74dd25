// Pairs of movers by one sort and one sweep along x: for approaches that treat the still scene
// only.
#pragma once

#include <algorithm>
#include <numeric>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {

class MoverSweep {
 public:
  void tell(std::span<const Box> movers, PairTally& tally) {
    if (order_.size() != movers.size()) {
      order_.resize(movers.size());
      std::iota(order_.begin(), order_.end(), 0u);
    }
    std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return movers[a].min.x() < movers[b].min.x();
    });
    for (std::size_t i = 0; i < order_.size(); ++i) {
      const Box& box = movers[order_[i]];
      for (std::size_t k = i + 1; k < order_.size(); ++k) {
        const Box& other = movers[order_[k]];
        if (other.min.x() > box.max.x()) break;
        if (collision::overlaps(box, other)) tally.addMovers(order_[i], order_[k]);
      }
    }
  }

 private:
  std::vector<std::uint32_t> order_;  ///< last tick's, nearly sorted
};

}  // namespace enfilade::benchmarks
