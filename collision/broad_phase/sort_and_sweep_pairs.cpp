// The pairs that a sweep holds: how they begin and end, and that each is told once.

#include <algorithm>
#include <limits>

#include "collision/broad_phase/sort_and_sweep_state.hpp"

namespace enfilade::collision {
namespace {

using Partner = SortAndSweep::Partner;

bool addPartner(std::vector<Partner>& partners, const Partner& partner) {
  const auto at = std::lower_bound(partners.begin(), partners.end(), partner);
  if (at != partners.end() && *at == partner) return false;
  partners.insert(at, partner);
  return true;
}

bool erasePartner(std::vector<Partner>& partners, const Partner& partner) {
  const auto at = std::lower_bound(partners.begin(), partners.end(), partner);
  if (at == partners.end() || *at != partner) return false;
  partners.erase(at);
  return true;
}

}  // namespace

void SortAndSweep::State::beginStill(MoverId id, StillId other) {
  if (!addPartner(movers[id].partners, {other, false})) return;
  begun.push_back({id, other, false});
  ++pairs;
}

void SortAndSweep::State::endStill(MoverId id, StillId other) {
  if (!erasePartner(movers[id].partners, {other, false})) return;
  ended.push_back({id, other, false});
  --pairs;
}

/// The still partners of the mover are those in `inReach` now, whatever they were.
void SortAndSweep::State::replaceStill(MoverId id) {
  std::vector<Partner>& partners = movers[id].partners;
  std::sort(inReach.begin(), inReach.end());
  merged.clear();
  auto held = partners.begin();
  const auto endHeldBefore = [&](StillId limit) {
    for (; held != partners.end() && !held->moves && held->id < limit; ++held) {
      ended.push_back({id, held->id, false});
      --pairs;
    }
  };
  for (const StillId other : inReach) {
    endHeldBefore(other);
    if (held != partners.end() && !held->moves && held->id == other) {
      ++held;
    } else {
      begun.push_back({id, other, false});
      ++pairs;
    }
    merged.push_back({other, false});
  }
  endHeldBefore(static_cast<StillId>(-1));
  merged.insert(merged.end(), held, partners.end());
  partners.assign(merged.begin(), merged.end());
}

void SortAndSweep::State::beginMoving(MoverId a, MoverId b) {
  addPartner(movers[a].partners, {b, true});
  addPartner(movers[b].partners, {a, true});
  begun.push_back({std::min(a, b), std::max(a, b), true});
  ++pairs;
}

void SortAndSweep::State::endMoving(MoverId a, MoverId b) {
  erasePartner(movers[a].partners, {b, true});
  erasePartner(movers[b].partners, {a, true});
  ended.push_back({std::min(a, b), std::max(a, b), true});
  --pairs;
}

void SortAndSweep::State::dropAll(MoverId id) {
  Mover& mover = movers[id];
  while (!mover.neighbours.empty()) endNeighbours(id, mover.neighbours.back().id);
  inReach.clear();
  replaceStill(id);
}

}  // namespace enfilade::collision
