// One pass a half-axis picks the ends that lie between the borders, without a branch: which do is
// past guessing. A list mostly has a handful, which insertion sorts.

#include "collision/broad_phase/proxy_window.hpp"

#include <algorithm>

namespace enfilade::collision {
namespace {

using End = MoverCell::End;

constexpr std::size_t kFewEnds = 24;  // of a list, that are sorted by insertion

bool before(const End& a, const End& b) {
  return a.at < b.at;
}

void sortEnds(End* first, End* last) {
  if (static_cast<std::size_t>(last - first) > kFewEnds) {
    std::sort(first, last, before);
    return;
  }
  for (End* end = first; end != last; ++end) {
    const End moving = *end;
    End* to = end;
    for (; to != first && moving.at < to[-1].at; --to) *to = to[-1];
    *to = moving;
  }
}

/// Picks the rows that end on half-axis `k`; returns the end of `ends`.
End* pickEnds(const StillCells& still, std::span<const StillCells::Row> rows, std::size_t k,
              std::span<const MoverCell::StillBox> boxes, End* ends) {
  End* picked = ends;
  for (std::uint32_t r = 0; r < rows.size(); ++r) {
    picked->box = r;
    picked += boxes[r].ending >> k & 1;
  }
  for (End* end = ends; end != picked; ++end) end->at = still.onset(rows[end->box])[k];
  sortEnds(ends, picked);
  return picked;
}

/// Room for `size` entries, without keeping that of a place much fuller.
template <class T>
void fit(std::vector<T>& room, std::size_t size) {
  constexpr std::size_t kMuch = 8, kLittle = 1024;
  if (room.size() > kMuch * size + kLittle) room = std::vector<T>();
  if (room.size() < size) room.resize(size);
}

}  // namespace

void MoverCell::lay(const StillCells& still, std::span<const StillCells::Row> rows,
                    const HalfAxes& reach, std::vector<std::uint32_t>& met) {
  fit(boxes, rows.size());
  if (met.size() < rows.size()) met.resize(rows.size());
  std::size_t metCount = 0;
  // The borders, and room for an end of each box between those of each half-axis: pickEnds() writes
  // past its list.
  const std::size_t endCount = 12 + 6 * rows.size();
  unsigned endingOnes = 0;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const HalfAxes& onset = still.onset(rows[r]);
    const unsigned apart = beyond(onset, reach), ending = beyond(onset, nearest);
    const std::uint32_t id = still.idOf(rows[r]);
    boxes[r] = {id, static_cast<std::uint8_t>(apart), static_cast<std::uint8_t>(ending)};
    met[metCount] = id;
    metCount += apart == 0 ? 1 : 0;
    endingOnes |= ending;
  }
  fit(ends, endCount);
  met.resize(metCount);
  End* end = ends.data();
  for (std::size_t k = 0; k < 6; ++k) {
    *end++ = {nearest[k], kBorder};
    End* beyondReach = end;
    if ((endingOnes >> k & 1) != 0) {
      end = pickEnds(still, rows, k, boxes, end);
      while (beyondReach != end && beyondReach->at <= reach[k]) ++beyondReach;
    }
    next[k] = static_cast<std::uint32_t>(beyondReach - ends.data());
    *end++ = {farthest[k], kBorder};
  }
}

}  // namespace enfilade::collision
