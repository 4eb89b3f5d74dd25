// Brute force shares nothing with the sweep but overlaps().

#include "collision/broad_phase/broad_phase_audit.hpp"

#include <algorithm>
#include <iterator>

namespace enfilade::collision {
namespace {

/// Each pair once, whichever of its movers was asked about.
void sortEachOnce(std::vector<BoxPair>& pairs) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

BoxPair movingPair(MoverId a, MoverId b) {
  return {std::min(a, b), std::max(a, b), true};
}

std::vector<BoxPair> heldBy(const SortAndSweep& sweep, std::span<const MoverId> asked) {
  std::vector<BoxPair> pairs;
  for (const MoverId id : asked) {
    for (const SortAndSweep::Partner& partner : sweep.partners(id)) {
      pairs.push_back(partner.moves ? movingPair(id, partner.id) : BoxPair{id, partner.id, false});
    }
  }
  sortEachOnce(pairs);
  return pairs;
}

std::vector<BoxPair> overlapsOf(const std::pair<MoverId, Box>& mover,
                                std::span<const Box> stillBoxes,
                                std::span<const std::pair<MoverId, Box>> moverBoxes) {
  std::vector<BoxPair> pairs = bruteForcePairs(stillBoxes, std::span(&mover, 1));
  for (const auto& [id, box] : moverBoxes) {
    if (id != mover.first && overlaps(box, mover.second)) {
      pairs.push_back(movingPair(id, mover.first));
    }
  }
  return pairs;
}

BroadPhaseAudit compared(const std::vector<BoxPair>& expected, const std::vector<BoxPair>& held) {
  BroadPhaseAudit audit;
  audit.pairs = expected.size();
  std::set_difference(expected.begin(), expected.end(), held.begin(), held.end(),
                      std::back_inserter(audit.missed));
  std::set_difference(held.begin(), held.end(), expected.begin(), expected.end(),
                      std::back_inserter(audit.extra));
  return audit;
}

}  // namespace

BroadPhaseAudit compareWithBruteForce(const SortAndSweep& sweep, std::span<const Box> stillBoxes,
                                      std::span<const std::pair<MoverId, Box>> moverBoxes,
                                      std::span<const MoverId> asked) {
  std::vector<BoxPair> expected;
  for (const auto& mover : moverBoxes) {
    if (std::find(asked.begin(), asked.end(), mover.first) == asked.end()) continue;
    const std::vector<BoxPair> pairs = overlapsOf(mover, stillBoxes, moverBoxes);
    expected.insert(expected.end(), pairs.begin(), pairs.end());
  }
  sortEachOnce(expected);
  return compared(expected, heldBy(sweep, asked));
}

BroadPhaseAudit compareWithBruteForce(const SortAndSweep& sweep, std::span<const Box> stillBoxes,
                                      std::span<const std::pair<MoverId, Box>> moverBoxes) {
  std::vector<MoverId> all;
  for (const auto& [id, box] : moverBoxes) all.push_back(id);
  return compareWithBruteForce(sweep, stillBoxes, moverBoxes, all);
}

}  // namespace enfilade::collision
