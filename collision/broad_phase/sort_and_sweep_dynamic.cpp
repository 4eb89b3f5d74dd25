// Dynamic proxies against each other.
//
// Proxy windows are boxes that change rarely. Three sorted endpoint lists (endpoint_lists.hpp)
// report windows that begin or cease to overlap. Proxies with separate windows cannot overlap and
// cost nothing. Proxies with overlapping windows are neighbours. Their boxes are compared when one
// of them has moved, first on the last separating axis, then on all six signed axes.
#include "collision/broad_phase/sort_and_sweep_dynamic.hpp"

#include <algorithm>
#include <array>

#include "collision/assert.hpp"
#include "collision/broad_phase/sort_and_sweep_pairs.hpp"

namespace enfilade::collision {
namespace {

std::uint8_t getOppositeAxis(std::uint8_t k) {
  constexpr std::array<std::uint8_t, 7> kOpposite{3, 4, 5, 0, 1, 2, Neighbour::kOverlapping};
  ENFILADE_ASSERT(k < kOpposite.size());
  return kOpposite[k];
}

/// True if signed axis `k` separates `a` from `b`. The sign of the rounded sum is exact.
bool isSeparatedOn(const SignedBounds& a, const SignedBounds& b, std::uint8_t k) {
  return a[k] + b[getOppositeAxis(k)] < 0;
}

/// Signed axis of `a` with the largest separation from `b`; kOverlapping if the boxes overlap.
std::uint8_t findSeparatingAxis(const SignedBounds& a, const SignedBounds& b) {
  std::uint8_t separatingAxis = Neighbour::kOverlapping;
  double minSum = 0;
  for (std::uint8_t k = 0; k < 6; ++k) {
    const double sum = a[k] + b[getOppositeAxis(k)];
    separatingAxis = sum < minSum ? k : separatingAxis;
    minSum = std::min(sum, minSum);
  }
  return separatingAxis;
}

/// Position of a proxy in the sorted neighbours, or its insertion point.
auto findNeighbour(std::vector<Neighbour>& neighbours, ProxyId id) {
  return std::lower_bound(neighbours.begin(), neighbours.end(), id,
                          [](const Neighbour& n, ProxyId sought) { return n.id < sought; });
}

void testNeighbours(SweepState& sweep, ProxyId id) {
  const SignedBounds& maxEndpoints = sweep.proxyMaxEndpoints[id];
  sweep.neighbourTests += sweep.proxies[id].neighbours.size();
  for (Neighbour& neighbour : sweep.proxies[id].neighbours) {
    if (neighbour.id < id && sweep.hasMoved[neighbour.id] != 0)
      continue;  // the other tests this pair
    const SignedBounds& other = sweep.proxyMaxEndpoints[neighbour.id];
    if (!neighbour.isOverlapping() && isSeparatedOn(maxEndpoints, other, neighbour.separatingAxis))
      continue;
    ++sweep.counters.aabbTests;
    const bool wasOverlapping = neighbour.isOverlapping();
    neighbour.separatingAxis = findSeparatingAxis(maxEndpoints, other);
    if (neighbour.isOverlapping() == wasOverlapping) continue;
    std::vector<Neighbour>& theirs = sweep.proxies[neighbour.id].neighbours;
    const auto own = findNeighbour(theirs, id);
    ENFILADE_ASSERT(own != theirs.end() && own->id == id);
    own->separatingAxis = getOppositeAxis(neighbour.separatingAxis);
    if (!wasOverlapping) {
      addDynamicOverlap(sweep, id, neighbour.id);
    } else {
      removeDynamicOverlap(sweep, id, neighbour.id);
    }
  }
}

}  // namespace

void addNeighbours(SweepState& sweep, ProxyId a, ProxyId b) {
  ENFILADE_ASSERT(a != b);
  std::vector<Neighbour>&ofA = sweep.proxies[a].neighbours, &ofB = sweep.proxies[b].neighbours;
  const auto at = findNeighbour(ofA, b);
  if (at != ofA.end() && at->id == b) return;
  const std::uint8_t separatingAxis =
      findSeparatingAxis(sweep.proxyMaxEndpoints[a], sweep.proxyMaxEndpoints[b]);
  ++sweep.counters.aabbTests;
  ofA.insert(at, {b, separatingAxis});
  const auto other = findNeighbour(ofB, a);
  ENFILADE_ASSERT(other == ofB.end() || other->id != a);  // neighbours are symmetric
  ofB.insert(other, {a, getOppositeAxis(separatingAxis)});
  if (separatingAxis == Neighbour::kOverlapping) addDynamicOverlap(sweep, a, b);
}

void removeNeighbours(SweepState& sweep, ProxyId a, ProxyId b) {
  std::vector<Neighbour>&ofA = sweep.proxies[a].neighbours, &ofB = sweep.proxies[b].neighbours;
  const auto at = findNeighbour(ofA, b);
  if (at == ofA.end() || at->id != b) return;
  if (at->isOverlapping()) removeDynamicOverlap(sweep, a, b);
  ofA.erase(at);
  const auto other = findNeighbour(ofB, a);
  ENFILADE_ASSERT(other != ofB.end() && other->id == a);
  ofB.erase(other);
}

void updateNeighbours(SweepState& sweep) {
  sweep.changes.clear();
  for (const ProxyId id : sweep.rebuilt)
    sweep.windowLists.setMaxEndpoints(id, sweep.proxies[id].window.maxBounds);
  for (const ProxyId id : sweep.rebuilt) {
    if (sweep.proxies[id].state == ProxyState::active) sweep.windowLists.move(id, sweep.changes);
  }
  sweep.windowLists.insert(sweep.added, sweep.changes);
  sweep.windowLists.commit(sweep.rebuilt);
  for (const PairChange& change : sweep.changes) {
    if (change.added) {
      addNeighbours(sweep, change.a, change.b);
    } else {
      removeNeighbours(sweep, change.a, change.b);
    }
  }
  sweep.neighbourTests = 0;
  for (std::size_t k = 0; k < sweep.moved.size(); ++k) {
    if (k + kPrefetchDistance < sweep.moved.size()) {
      __builtin_prefetch(sweep.proxies[sweep.moved[k + kPrefetchDistance]].neighbours.data());
    }
    testNeighbours(sweep, sweep.moved[k]);
  }
}

}  // namespace enfilade::collision
