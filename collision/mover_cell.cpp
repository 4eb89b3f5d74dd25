// One pass over the boxes counts the ends of each list, a second puts them in by insertion (a list
// mostly has a handful; long ones are sorted at last).

#include "collision/mover_cell.hpp"

#include <algorithm>
#include <bit>

namespace enfilade::collision {
namespace {

using End = MoverCell::End;

constexpr std::uint32_t kFewEnds = 32;  // that are sorted by insertion

bool before(const End& a, const End& b) {
  return a.at < b.at;
}

/// Into an ascending list of `count`; into a long one at its end, to be sorted at last.
void insertSorted(End* list, std::uint32_t count, const End& end) {
  for (; count > 0 && count < kFewEnds && end.at < list[count - 1].at; --count)
    list[count] = list[count - 1];
  list[count] = end;
}

}  // namespace

void MoverCell::lay(const StillCells& still, std::span<const StillCells::Row> rows,
                    const HalfAxes& reach, std::vector<std::uint32_t>& met) {
  std::array<std::uint32_t, 6> first, count{}, within{};
  for (const StillCells::Row row : rows) {
    for (unsigned bits = beyond(still.onset(row), nearest); bits != 0; bits &= bits - 1) {
      ++count[static_cast<std::size_t>(std::countr_zero(bits))];
    }
  }
  std::uint32_t total = 0;
  for (std::size_t k = 0; k < 6; ++k) {
    first[k] = total + 1;
    total += count[k] + 2;
  }
  ends.resize(total);
  boxes.clear();
  met.clear();
  count.fill(0);
  for (const StillCells::Row row : rows) {
    const HalfAxes& onset = still.onset(row);
    const unsigned apart = beyond(onset, reach), ending = beyond(onset, nearest);
    if (apart == 0) met.push_back(still.idOf(row));
    if (ending == 0) continue;
    const auto box = static_cast<std::uint32_t>(boxes.size());
    boxes.push_back({still.idOf(row), static_cast<std::uint8_t>(apart)});
    for (unsigned bits = ending; bits != 0; bits &= bits - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(bits));
      within[k] += ~apart >> k & 1;
      insertSorted(ends.data() + first[k], count[k]++, {onset[k], box});
    }
  }
  for (std::size_t k = 0; k < 6; ++k) {
    End* const list = ends.data() + first[k];
    list[-1] = {nearest[k], kBorder};
    list[count[k]] = {farthest[k], kBorder};
    if (count[k] > kFewEnds) std::sort(list, list + count[k], before);
    next[k] = first[k] + within[k];
  }
}

}  // namespace enfilade::collision
