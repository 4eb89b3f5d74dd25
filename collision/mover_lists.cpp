// Each mover's ends bubble to their place, one mover after the other. While the first ones are
// repaired the ends of the others still stand where they stood, so an exchange may be undone later
// in the same update. What an exchange means is therefore decided by the final boxes: if a pair's
// overlap differs from the last update, then on some axis a lower and an upper end of the two are
// in another order than before, so that they exchanged in the telling sense at least once.

#include "collision/mover_lists.hpp"

#include <algorithm>

namespace enfilade::collision {

void MoverLists::setBox(std::uint32_t mover, const Box& box) {
  if (mover >= boxes_.size()) {
    boxes_.resize(mover + 1);
    marked_.resize(mover + 1, 0);
    for (auto& position : position_) position.resize(2 * std::size_t{mover} + 2, 0);
  }
  boxes_[mover] = box;
}

void MoverLists::renumber(int axis) {
  const auto a = static_cast<std::size_t>(axis);
  for (std::uint32_t k = 0; k < ends_[a].size(); ++k) position_[a][ends_[a][k].tag] = k;
}

void MoverLists::remove(std::span<const std::uint32_t> movers) {
  if (movers.empty()) return;
  for (const std::uint32_t mover : movers) marked_[mover] = 1;
  for (int axis = 0; axis < 3; ++axis) {
    std::erase_if(ends_[static_cast<std::size_t>(axis)],
                  [this](const End& end) { return marked_[end.mover()] != 0; });
    renumber(axis);
  }
  for (const std::uint32_t mover : movers) marked_[mover] = 0;
}

void MoverLists::confirm(std::uint32_t a, std::uint32_t b, std::vector<MoverChange>& changes) {
  ++boxTests;
  if (overlaps(boxes_[a], boxes_[b])) changes.push_back({std::min(a, b), std::max(a, b), true});
}

void MoverLists::exchanged(const End& moving, const End& other, bool up,
                           std::vector<MoverChange>& changes) {
  ++exchanges;
  if (moving.upper() == other.upper()) return;
  const bool opens = moving.upper() == up;
  ++boxTests;
  const std::uint32_t a = std::min(moving.mover(), other.mover());
  const std::uint32_t b = std::max(moving.mover(), other.mover());
  if (overlaps(boxes_[a], boxes_[b]) == opens) changes.push_back({a, b, opens});
}

void MoverLists::bubble(int axis, End end, std::vector<MoverChange>& changes) {
  std::vector<End>& ends = ends_[static_cast<std::size_t>(axis)];
  std::vector<std::uint32_t>& position = position_[static_cast<std::size_t>(axis)];
  std::uint32_t at = position[end.tag];
  const std::uint32_t from = at;
  while (at + 1 < ends.size() && before(ends[at + 1], end)) {
    exchanged(end, ends[at + 1], true, changes);
    ends[at] = ends[at + 1];
    position[ends[at].tag] = at;
    ++at;
  }
  while (at <= from && at > 0 && before(end, ends[at - 1])) {
    exchanged(end, ends[at - 1], false, changes);
    ends[at] = ends[at - 1];
    position[ends[at].tag] = at;
    --at;
  }
  ends[at] = end;
  position[end.tag] = at;
}

void MoverLists::move(std::uint32_t mover, std::vector<MoverChange>& changes) {
  const Box& box = boxes_[mover];
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const End lower{box.min[axis], 2 * mover};
    const End upper{box.max[axis], 2 * mover + 1};
    // The end that leads goes first, so that a mover's two ends never pass one another.
    if (upper.at >= ends_[a][position_[a][upper.tag]].at) {
      bubble(axis, upper, changes);
      bubble(axis, lower, changes);
    } else {
      bubble(axis, lower, changes);
      bubble(axis, upper, changes);
    }
  }
}

void MoverLists::insert(std::span<const std::uint32_t> movers, std::vector<MoverChange>& changes) {
  if (movers.empty()) return;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<End>& ends = ends_[static_cast<std::size_t>(axis)];
    const auto old = static_cast<std::ptrdiff_t>(ends.size());
    for (const std::uint32_t mover : movers) {
      ends.push_back({boxes_[mover].min[axis], 2 * mover});
      ends.push_back({boxes_[mover].max[axis], 2 * mover + 1});
    }
    std::stable_sort(ends.begin() + old, ends.end(), before);
    std::inplace_merge(ends.begin(), ends.begin() + old, ends.end(), before);
    renumber(axis);
  }
  sweep(movers, changes);
}

/// One sweep over the x list; pairs of two old movers are known already.
void MoverLists::sweep(std::span<const std::uint32_t> fresh, std::vector<MoverChange>& changes) {
  for (const std::uint32_t mover : fresh) marked_[mover] = 1;
  for (const End& end : ends_[0]) {
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
