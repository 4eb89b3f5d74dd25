// The slow twin of the broad phase; it shares nothing with it but overlaps().

#include <algorithm>

#include "collision/broad_phase/sort_and_sweep.hpp"

namespace enfilade::collision {

std::vector<BoxPair> bruteForcePairs(std::span<const Box> stillBoxes,
                                     std::span<const std::pair<MoverId, Box>> moverBoxes) {
  std::vector<BoxPair> pairs;
  for (const auto& [id, box] : moverBoxes) {
    for (std::size_t other = 0; other < stillBoxes.size(); ++other) {
      if (overlaps(box, stillBoxes[other])) {
        pairs.push_back({id, static_cast<std::uint32_t>(other), false});
      }
    }
    for (const auto& [otherId, otherBox] : moverBoxes) {
      if (id < otherId && overlaps(box, otherBox)) pairs.push_back({id, otherId, true});
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace enfilade::collision
