// One pass over the boxes counts the ends of each list, a second puts them in by insertion (a list
// mostly has a handful; long ones are sorted at last).

#include "collision/mover_cell.hpp"

#include <algorithm>
#include <limits>

namespace enfilade::collision {
namespace {

using End = MoverCell::End;

constexpr std::uint32_t kFewEnds = 32;  // that are sorted by insertion

bool before(const End& a, const End& b) {
  return a.at < b.at;
}

/// Into an ascending list of `count`, before the end of which there is room.
void insertSorted(End* list, std::uint32_t count, const End& end) {
  for (; count > 0 && end.at < list[count - 1].at; --count) list[count] = list[count - 1];
  list[count] = end;
}

}  // namespace

void MoverCell::close() {
  low.fill(std::numeric_limits<double>::infinity());
  ends.clear();
  boxes.clear();
}

void MoverCell::lay(const StillCells& still, std::span<const StillCells::Row> rows,
                    const HalfAxes& reach, std::vector<std::uint32_t>& met) {
  std::array<std::uint32_t, 6> count{}, within{}, first{};
  for (const StillCells::Row row : rows) {
    const HalfAxes& onset = still.onset(row);
    for (std::size_t k = 0; k < 6; ++k) count[k] += onset[k] > nearest[k] ? 1u : 0u;
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
    const auto box = static_cast<std::uint32_t>(boxes.size());
    unsigned apart = 0;
    bool ending = false;
    for (std::size_t k = 0; k < 6; ++k) {
      if (!(onset[k] > nearest[k])) continue;
      ending = true;
      if (onset[k] > reach[k]) {
        apart |= 1u << k;
      } else {
        ++within[k];
      }
      End* const list = ends.data() + first[k];
      if (count[k] < kFewEnds) {
        insertSorted(list, count[k], {onset[k], box});
      } else {
        list[count[k]] = {onset[k], box};
      }
      ++count[k];
    }
    if (apart == 0) met.push_back(still.idOf(row));
    if (ending) boxes.push_back({still.idOf(row), static_cast<std::uint8_t>(apart)});
  }
  for (std::size_t k = 0; k < 6; ++k) {
    End* const list = ends.data() + first[k];
    list[-1] = {nearest[k], kBorder};
    list[count[k]] = {farthest[k], kBorder};
    if (count[k] > kFewEnds) std::sort(list, list + count[k], before);
    next[k] = first[k] + within[k];
    guard(k);
  }
}

}  // namespace enfilade::collision
