// Movers against movers.
//
// The cells of the movers are boxes as well, and change once in a while. Their ends stand in three
// sorted lists that are repaired by insertion (mover_lists.hpp); an exchange tells that two cells
// have met or parted. Movers whose cells do not meet cannot, and cost nothing. Of two whose cells
// do, neighbours, the twelve end points are compared when one of them has moved.

#include <algorithm>

#include "collision/sort_and_sweep_state.hpp"

namespace enfilade::collision {
namespace {

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
  const bool overlap = overlapping(movers[a].reach, movers[b].reach);
  ++counters.boxTests;
  ofA.insert(at, {b, overlap});
  ofB.insert(find(ofB, a), {a, overlap});
  if (overlap) beginMoving(a, b);
}

void SortAndSweep::State::endNeighbours(MoverId a, MoverId b) {
  std::vector<Neighbour>&ofA = movers[a].neighbours, &ofB = movers[b].neighbours;
  const auto at = find(ofA, b);
  if (at == ofA.end() || at->id != b) return;
  if (at->met) endMoving(a, b);
  ofA.erase(at);
  ofB.erase(find(ofB, a));
}

void SortAndSweep::State::testNeighbours(MoverId id) {
  for (Neighbour& neighbour : movers[id].neighbours) {
    if (neighbour.id < id && isStirred[neighbour.id] != 0) continue;  // it tests the two
    const Mover& other = movers[neighbour.id];
    ++counters.boxTests;
    const bool overlap = overlapping(movers[id].reach, other.reach);
    if (overlap == neighbour.met) continue;
    neighbour.met = overlap;
    find(movers[neighbour.id].neighbours, id)->met = overlap;
    if (overlap) {
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
  for (const MoverId id : stirred) testNeighbours(id);
  counters.exchanges += lists.exchanges;
  counters.boxTests += lists.boxTests;
}

}  // namespace enfilade::collision
