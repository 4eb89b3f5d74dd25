// Movers against movers.
//
// The cells of the movers are boxes as well, and change once in a while. Their ends stand in three
// sorted lists that are repaired by insertion (mover_lists.hpp); an exchange tells that two cells
// have met or parted. Movers whose cells do not meet cannot, and cost nothing. Of two whose cells
// do, neighbours, end points are compared when one of them has moved: the two on the half-axis on
// which they were found apart last, and all twelve if these overlap by now.

#include <algorithm>
#include <array>

#include "collision/broad_phase/sort_and_sweep_state.hpp"

namespace enfilade::collision {
namespace {

std::uint8_t opposite(std::uint8_t k) {
  constexpr std::array<std::uint8_t, 7> kOpposite{3, 4, 5, 0, 1, 2, Neighbour::kMet};
  return kOpposite[k];
}

/// Whether the box of `a` ends on half-axis `k` before that of `b` begins: the sum is exact in
/// sign.
bool isApart(const HalfAxes& a, const HalfAxes& b, std::uint8_t k) {
  return a[k] + b[opposite(k)] < 0;
}

/// A half-axis of `a` on which they are apart, the one on which they are farthest; kMet if none.
std::uint8_t apartOn(const HalfAxes& a, const HalfAxes& b) {
  std::uint8_t apart = Neighbour::kMet;
  double least = 0;
  for (std::uint8_t k = 0; k < 6; ++k) {
    const double sum = a[k] + b[opposite(k)];
    apart = sum < least ? k : apart;
    least = std::min(sum, least);
  }
  return apart;
}

/// The place of a mover among neighbours, or where it belongs.
auto find(std::vector<Neighbour>& neighbours, MoverId id) {
  return std::lower_bound(neighbours.begin(), neighbours.end(), id,
                          [](const Neighbour& n, MoverId sought) { return n.id < sought; });
}

}  // namespace

void SortAndSweep::State::beginNeighbours(MoverId a, MoverId b) {
  std::vector<Neighbour>&ofA = movers[a].neighbours, &ofB = movers[b].neighbours;
  const auto at = find(ofA, b);
  if (at != ofA.end() && at->id == b) return;
  const std::uint8_t apart = apartOn(reaches[a], reaches[b]);
  ++counters.boxTests;
  ofA.insert(at, {b, apart});
  ofB.insert(find(ofB, a), {a, opposite(apart)});
  if (apart == Neighbour::kMet) beginMoving(a, b);
}

void SortAndSweep::State::endNeighbours(MoverId a, MoverId b) {
  std::vector<Neighbour>&ofA = movers[a].neighbours, &ofB = movers[b].neighbours;
  const auto at = find(ofA, b);
  if (at == ofA.end() || at->id != b) return;
  if (at->met()) endMoving(a, b);
  ofA.erase(at);
  ofB.erase(find(ofB, a));
}

void SortAndSweep::State::testNeighbours(MoverId id) {
  const HalfAxes& reach = reaches[id];
  for (Neighbour& neighbour : movers[id].neighbours) {
    if (neighbour.id < id && isStirred[neighbour.id] != 0) continue;  // it tests the two
    const HalfAxes& other = reaches[neighbour.id];
    if (!neighbour.met() && isApart(reach, other, neighbour.apart)) continue;
    ++counters.boxTests;
    const bool wasMet = neighbour.met();
    neighbour.apart = apartOn(reach, other);
    if (neighbour.met() == wasMet) continue;
    find(movers[neighbour.id].neighbours, id)->apart = opposite(neighbour.apart);
    if (!wasMet) {
      beginMoving(id, neighbour.id);
    } else {
      endMoving(id, neighbour.id);
    }
  }
}

void SortAndSweep::State::updateMoving() {
  lists.exchanges = lists.boxTests = 0;
  changes.clear();
  for (const MoverId id : relaid) lists.setReach(id, movers[id].cell.farthest);
  for (const MoverId id : relaid) {
    if (movers[id].presence == Presence::live) lists.move(id, changes);
  }
  lists.insert(fresh, changes);
  lists.settle(relaid);
  for (const MoverChange& change : changes) {
    if (change.begins) {
      beginNeighbours(change.a, change.b);
    } else {
      endNeighbours(change.a, change.b);
    }
  }
  for (std::size_t k = 0; k < stirred.size(); ++k) {
    if (k + kAskedAhead < stirred.size()) {
      __builtin_prefetch(movers[stirred[k + kAskedAhead]].neighbours.data());
    }
    testNeighbours(stirred[k]);
  }
  counters.exchanges += lists.exchanges;
  counters.boxTests += lists.boxTests;
}

}  // namespace enfilade::collision
