// Each mover's ends bubble to their place, one mover after the other. While the first ones are
// repaired the ends of the others still stand where they stood, so an exchange may be undone later
// in the same update. What an exchange means is therefore decided by the boxes before and after the
// update: if a pair's overlap differs, then on some axis a lower and an upper end of the two are in
// another order than before, so that they exchanged in the telling sense at least once.

#include "collision/broad_phase/endpoint_lists.hpp"

#include <algorithm>

namespace enfilade::collision {

void MoverLists::makeRoomFor(std::uint32_t mover) {
  reach_.resize(mover + std::size_t{1});
  settled_.resize(mover + std::size_t{1});
  positions_.resize(mover + std::size_t{1});
  marked_.resize(mover + std::size_t{1}, 0);
  passed_.resize(2 * (mover + std::size_t{1}));
}

void MoverLists::settle(std::span<const std::uint32_t> movers) {
  for (const std::uint32_t mover : movers) settled_[mover] = reach_[mover];
}

void MoverLists::renumber(std::size_t axis) {
  const Ends& ends = ends_[axis];
  for (std::uint32_t k = 1; k + 1 < ends.size(); ++k) positionOf(axis, ends[k].tag) = k;
}

void MoverLists::remove(std::span<const std::uint32_t> movers) {
  if (movers.empty()) return;
  for (const std::uint32_t mover : movers) marked_[mover] = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Ends& ends = ends_[axis];
    ends.erase(std::remove_if(ends.begin() + 1, ends.end() - 1,
                              [this](const End& end) { return marked_[end.mover()] != 0; }),
               ends.end() - 1);
    renumber(axis);
  }
  for (const std::uint32_t mover : movers) marked_[mover] = 0;
}

void MoverLists::confirm(std::uint32_t a, std::uint32_t b, std::vector<MoverChange>& changes) {
  ++boxTests;
  if (overlapping(reach_[a], reach_[b])) changes.push_back({std::min(a, b), std::max(a, b), true});
}

/// An end of `mover` and the other end of each of the first `count` movers in `passed_` have passed
/// one another: they opened an overlap, or closed one.
void MoverLists::exchanged(std::uint32_t mover, std::size_t count, bool opens,
                           std::vector<MoverChange>& changes) {
  boxTests += count;
  // First the condition that seldom holds: most boxes that pass on one axis are far apart.
  const std::vector<HalfAxes>&with = opens ? reach_ : settled_,
        &without = opens ? settled_ : reach_;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t other = passed_[k];
    if (overlapping(with[mover], with[other]) && !overlapping(without[mover], without[other])) {
      changes.push_back({std::min(mover, other), std::max(mover, other), opens});
    }
  }
}

// Which of the ends that are passed are of the other kind is past guessing: all are written, and
// counted if they are.

void MoverLists::bubbleUp(std::size_t axis, End end, std::vector<MoverChange>& changes) {
  End* const ends = ends_[axis].data();
  const std::uint32_t from = positionOf(axis, end.tag);
  std::uint32_t at = from;
  std::size_t count = 0;
  for (; before(ends[at + 1], end); ++at) {
    const End other = ends[at + 1];
    passed_[count] = other.mover();
    count += other.upper() != end.upper() ? 1 : 0;
    ends[at] = other;
    positionOf(axis, other.tag) = at;
  }
  exchanges += at - from;
  ends[at] = end;
  positionOf(axis, end.tag) = at;
  exchanged(end.mover(), count, end.upper(), changes);
}

void MoverLists::bubbleDown(std::size_t axis, End end, std::vector<MoverChange>& changes) {
  End* const ends = ends_[axis].data();
  const std::uint32_t from = positionOf(axis, end.tag);
  std::uint32_t at = from;
  std::size_t count = 0;
  for (; before(end, ends[at - 1]); --at) {
    const End other = ends[at - 1];
    passed_[count] = other.mover();
    count += other.upper() != end.upper() ? 1 : 0;
    ends[at] = other;
    positionOf(axis, other.tag) = at;
  }
  exchanges += from - at;
  ends[at] = end;
  positionOf(axis, end.tag) = at;
  exchanged(end.mover(), count, !end.upper(), changes);
}

/// An end that has not moved is where it belongs, and one that has can only go its way. The end
/// that leads goes first, so that a mover's two ends never pass one another.
void MoverLists::repair(std::size_t axis, End lower, End upper, std::vector<MoverChange>& changes) {
  const double wasLower = ends_[axis][positionOf(axis, lower.tag)].at;
  const double wasUpper = ends_[axis][positionOf(axis, upper.tag)].at;
  if (upper.at > wasUpper) bubbleUp(axis, upper, changes);
  if (lower.at > wasLower) bubbleUp(axis, lower, changes);
  if (lower.at < wasLower) bubbleDown(axis, lower, changes);
  if (upper.at < wasUpper) bubbleDown(axis, upper, changes);
}

void MoverLists::move(std::uint32_t mover, std::vector<MoverChange>& changes) {
  const HalfAxes& reach = reach_[mover];
  const std::array<std::uint32_t, 6> position = positions_[mover];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low = -reach[axis], high = reach[axis + 3];
    End* const lower = &ends_[axis][position[2 * axis]];
    End* const upper = &ends_[axis][position[2 * axis + 1]];
    if (lower->at == low && upper->at == high) continue;
    // Mostly neither end meets another; ties are left to repair().
    if (lower[-1].at < low && low < lower[1].at && upper[-1].at < high && high < upper[1].at) {
      lower->at = low;
      upper->at = high;
    } else {
      repair(axis, {low, 2 * mover}, {high, 2 * mover + 1}, changes);
    }
  }
}

void MoverLists::insert(std::span<const std::uint32_t> movers, std::vector<MoverChange>& changes) {
  if (movers.empty()) return;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Ends& ends = ends_[axis];
    const End last = ends.back();
    ends.pop_back();
    const auto old = static_cast<std::ptrdiff_t>(ends.size());
    for (const std::uint32_t mover : movers) {
      ends.push_back({-reach_[mover][axis], 2 * mover});
      ends.push_back({reach_[mover][axis + 3], 2 * mover + 1});
    }
    std::stable_sort(ends.begin() + old, ends.end(), before);
    std::inplace_merge(ends.begin(), ends.begin() + old, ends.end(), before);
    ends.push_back(last);
    renumber(axis);
  }
  sweep(movers, changes);
}

/// One sweep over the x list; pairs of two old movers are known already.
void MoverLists::sweep(std::span<const std::uint32_t> fresh, std::vector<MoverChange>& changes) {
  for (const std::uint32_t mover : fresh) marked_[mover] = 1;
  for (std::size_t k = 1; k + 1 < ends_[0].size(); ++k) {
    const End& end = ends_[0][k];
    const std::uint32_t mover = end.mover();
    std::vector<std::uint32_t>& own = open_[marked_[mover]];
    if (end.upper()) {
      own.erase(std::find(own.begin(), own.end(), mover));
      continue;
    }
    for (const std::uint32_t other : open_[1]) confirm(mover, other, changes);
    if (marked_[mover] != 0) {
      for (const std::uint32_t other : open_[0]) confirm(mover, other, changes);
    }
    own.push_back(mover);
  }
  for (const std::uint32_t mover : fresh) marked_[mover] = 0;
}

}  // namespace enfilade::collision
