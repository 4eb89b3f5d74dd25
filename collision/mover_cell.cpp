// One pass a half-axis picks the ends that lie between the borders, without a branch: which do is
// past guessing. A list mostly has a handful, which insertion sorts.

#include "collision/mover_cell.hpp"

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

}  // namespace

void MoverCell::lay(const StillCells& still, std::span<const StillCells::Row> rows,
                    const HalfAxes& reach, std::vector<std::uint32_t>& met) {
  boxes.resize(rows.size());
  met.resize(rows.size());
  std::size_t metCount = 0;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const unsigned apart = beyond(still.onset(rows[r]), reach);
    boxes[r] = {still.idOf(rows[r]), static_cast<std::uint8_t>(apart)};
    met[metCount] = boxes[r].id;
    metCount += apart == 0 ? 1 : 0;
  }
  met.resize(metCount);
  if (ends.size() < 6 * (rows.size() + 2)) ends.resize(6 * (rows.size() + 2));
  End* end = ends.data();
  for (std::size_t k = 0; k < 6; ++k) {
    *end++ = {nearest[k], kBorder};
    End* const first = end;
    std::uint32_t within = 0;
    for (std::uint32_t r = 0; r < rows.size(); ++r) {
      const double onset = still.onset(rows[r])[k];
      *end = {onset, r};
      within += (onset > nearest[k]) & (onset <= reach[k]) ? 1 : 0;
      end += onset > nearest[k] ? 1 : 0;
    }
    sortEnds(first, end);
    next[k] = static_cast<std::uint32_t>(first - ends.data()) + within;
    *end++ = {farthest[k], kBorder};
  }
}

}  // namespace enfilade::collision
