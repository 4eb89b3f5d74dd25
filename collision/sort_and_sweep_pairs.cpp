// The pairs that a sweep holds: how they begin and end, and that each is told once.

#include <algorithm>

#include "collision/sort_and_sweep_state.hpp"

namespace enfilade::collision {
namespace {

using Partner = SortAndSweep::Partner;

// Up to so many new partners are inserted one by one; more are merged, lest it becomes quadratic.
constexpr std::size_t kFewFound = 16;

bool addPartner(std::vector<Partner>& partners, MoverId id) {
  const Partner partner{id, true};
  const auto at = std::lower_bound(partners.begin(), partners.end(), partner);
  if (at != partners.end() && *at == partner) return false;
  partners.insert(at, partner);
  return true;
}

bool erasePartner(std::vector<Partner>& partners, MoverId id) {
  const Partner partner{id, true};
  const auto at = std::lower_bound(partners.begin(), partners.end(), partner);
  if (at == partners.end() || *at != partner) return false;
  partners.erase(at);
  return true;
}

}  // namespace

void SortAndSweep::State::test(const Mover& mover, Row row) {
  ++counters.boxTests;
  if (meets(still.onset(row), mover.reach)) found.push_back({{still.idOf(row), false}, row});
}

void SortAndSweep::State::tellStill(MoverId id, Partner partner) {
  begun.push_back({id, partner.id, false});
  ++pairs;
}

void SortAndSweep::State::insertFound(MoverId id) {
  Mover& mover = movers[id];
  for (const Found& f : found) {
    const auto at = std::lower_bound(mover.partners.begin(), mover.partners.end(), f.partner);
    if (at != mover.partners.end() && *at == f.partner) continue;  // known from another cell
    mover.rows.insert(mover.rows.begin() + (at - mover.partners.begin()), f.row);
    mover.partners.insert(at, f.partner);
    tellStill(id, f.partner);
  }
}

void SortAndSweep::State::mergeFound(MoverId id) {
  Mover& mover = movers[id];
  const auto byPartner = [](const Found& a, const Found& b) { return a.partner < b.partner; };
  const auto samePartner = [](const Found& a, const Found& b) { return a.partner == b.partner; };
  std::sort(found.begin(), found.end(), byPartner);
  found.erase(std::unique(found.begin(), found.end(), samePartner), found.end());
  std::erase_if(found, [&](const Found& f) {
    return std::binary_search(mover.partners.begin(), mover.partners.end(), f.partner);
  });
  const auto added = static_cast<std::ptrdiff_t>(found.size());
  for (const Found& f : found) tellStill(id, f.partner);
  for (std::size_t i = 0; i < mover.rows.size(); ++i) {
    found.push_back({mover.partners[i], mover.rows[i]});
  }
  std::inplace_merge(found.begin(), found.begin() + added, found.end(), byPartner);
  mover.partners.insert(mover.partners.begin(), static_cast<std::size_t>(added), Partner{});
  mover.rows.resize(found.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    mover.partners[i] = found[i].partner;
    mover.rows[i] = found[i].row;
  }
}

/// Takes in the still boxes that were found to overlap; some are known already.
void SortAndSweep::State::takeFound(MoverId id) {
  if (found.size() <= kFewFound) {
    insertFound(id);
  } else {
    mergeFound(id);
  }
  found.clear();
}

void SortAndSweep::State::endStill(MoverId id, Row row) {
  Mover& mover = movers[id];
  const auto at = std::find(mover.rows.begin(), mover.rows.end(), row);
  if (at == mover.rows.end()) return;
  mover.partners.erase(mover.partners.begin() + (at - mover.rows.begin()));
  mover.rows.erase(at);
  ended.push_back({id, still.idOf(row), false});
  --pairs;
}

void SortAndSweep::State::beginMoving(MoverId a, MoverId b) {
  if (!addPartner(movers[a].partners, b)) return;
  addPartner(movers[b].partners, a);
  begun.push_back({a, b, true});
  ++pairs;
}

void SortAndSweep::State::endMoving(MoverId a, MoverId b) {
  if (!erasePartner(movers[a].partners, b)) return;
  erasePartner(movers[b].partners, a);
  ended.push_back({a, b, true});
  --pairs;
}

void SortAndSweep::State::dropAll(MoverId id) {
  Mover& mover = movers[id];
  while (!mover.partners.empty()) {
    const Partner last = mover.partners.back();
    if (last.moves) {
      endMoving(std::min(id, last.id), std::max(id, last.id));
    } else {
      endStill(id, mover.rows.back());
    }
  }
  mover.leaveCells();
}

/// Drops the still partners that the mover no longer meets.
void SortAndSweep::State::recheck(MoverId id) {
  Mover& mover = movers[id];
  std::size_t kept = 0;
  for (std::size_t i = 0; i < mover.rows.size(); ++i) {
    ++counters.boxTests;
    if (meets(still.onset(mover.rows[i]), mover.reach)) {
      mover.rows[kept] = mover.rows[i];
      mover.partners[kept++] = mover.partners[i];
    } else {
      ended.push_back({id, mover.partners[i].id, false});
      --pairs;
    }
  }
  const auto first = static_cast<std::ptrdiff_t>(kept);
  const auto last = static_cast<std::ptrdiff_t>(mover.rows.size());
  mover.partners.erase(mover.partners.begin() + first, mover.partners.begin() + last);
  mover.rows.resize(kept);
}

}  // namespace enfilade::collision
