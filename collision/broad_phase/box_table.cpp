#include "collision/broad_phase/box_table.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "collision/assert.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace enfilade::collision {
namespace {

constexpr std::size_t kExponents = 2048;  // of a double
// Cells of a level, at most, for each box. More cells take more memory and more time to clear.
// Fewer wrap more places onto one cell, so that more boxes are compared that are far apart.
constexpr double kCellsPerBox = 8;
// Cells on an axis: the neighbours of a cell on both sides must differ.
constexpr double kMinCells = 5;
constexpr double kMaxCells = 1 << 26;  // of a level
// Cell coordinates are clamped to this, which keeps their order.
constexpr double kMaxCoord = 0x1p40;
// Two levels with adjacent exponents are one, unless the finer one has this many times the boxes.
constexpr double kMergeRatio = 4;

std::int64_t floorToInt(double x) {
  const auto truncated = static_cast<std::int64_t>(x);
  return truncated - (static_cast<double>(truncated) > x ? 1 : 0);
}

std::int64_t toCoord(double position, double inverseEdge) {
  return floorToInt(std::clamp(position * inverseEdge, -kMaxCoord, kMaxCoord));
}

/// `coord` modulo `count`, from 0 to count - 1. `inverse`: about 1 / count.
std::int64_t wrap(std::int64_t coord, std::int64_t count, double inverse) {
  std::int64_t rest = coord - count * floorToInt(static_cast<double>(coord) * inverse);
  if (rest < 0) rest += count;
  if (rest >= count) rest -= count;
  ENFILADE_ASSERT(0 <= rest && rest < count);
  return rest;
}

bool isPrime(std::int64_t n) {
  for (std::int64_t d = 2; d * d <= n; ++d)
    if (n % d == 0) return false;
  return true;
}

std::array<double, 3> computeExtents(const SignedBounds& box) {
  return {box[0] + box[3], box[1] + box[4], box[2] + box[5]};
}

std::size_t computeExponent(const std::array<double, 3>& extent) {
  const double largest = std::max({extent[0], extent[1], extent[2]});
  return std::bit_cast<std::uint64_t>(largest) >> 52 & 0x7ff;
}

/// Writes (id, ids[k]) to `to` for each of `count` boxes that overlaps, which leaves no branch per
/// candidate: whether boxes overlap is unpredictable. Returns the end of what was written.
using AppendOverlaps = BoxTable::IdPair* (*)(const SignedBounds& minEndpoints, BoxTable::Id id,
                                             const SignedBounds* boxes, const BoxTable::Id* ids,
                                             std::uint32_t count, BoxTable::IdPair* to);

BoxTable::IdPair* appendOverlaps(const SignedBounds& minEndpoints, BoxTable::Id id,
                                 const SignedBounds* boxes, const BoxTable::Id* ids,
                                 std::uint32_t count, BoxTable::IdPair* to) {
  for (std::uint32_t k = 0; k < count; ++k) {
    *to = {id, ids[k]};
    to += isNoneGreater(minEndpoints, boxes[k]) ? 1 : 0;
  }
  return to;
}

#if defined(__x86_64__)
__attribute__((target("avx"))) BoxTable::IdPair* appendOverlapsAvx(
    const SignedBounds& minEndpoints, BoxTable::Id id, const SignedBounds* boxes,
    const BoxTable::Id* ids, std::uint32_t count, BoxTable::IdPair* to) {
  const __m256d first = _mm256_loadu_pd(&minEndpoints[0]);
  const __m128d last = _mm_loadu_pd(&minEndpoints[4]);
  for (std::uint32_t k = 0; k < count; ++k) {
    *to = {id, ids[k]};
    const __m256d greater = _mm256_cmp_pd(first, _mm256_loadu_pd(&boxes[k][0]), _CMP_GT_OQ);
    const __m128d greaterLast = _mm_cmpgt_pd(last, _mm_loadu_pd(&boxes[k][4]));
    to += (_mm256_movemask_pd(greater) | _mm_movemask_pd(greaterLast)) == 0 ? 1 : 0;
  }
  return to;
}
#else
constexpr AppendOverlaps appendOverlapsAvx = appendOverlaps;
#endif

}  // namespace

/// Up to ten runs that are not empty, of a cell's own row and the four rows after it. Each row is
/// in two parts where it wraps around.
struct BoxTable::RunList {
  std::array<Run, 10> all;
  std::size_t count = 0;
  void add(Run run) {
    all[count] = run;
    count += run.begin < run.end ? 1 : 0;
  }
  std::span<const Run> span() const { return std::span(all).first(count); }
};

class BoxTable::PairWriter {
 public:
  explicit PairWriter(std::vector<IdPair>& pairs)
      : pairs_(pairs), begin_(pairs.size()), count_(pairs.size()) {}
  ~PairWriter() { pairs_.resize(count_); }
  PairWriter(const PairWriter&) = delete;
  PairWriter& operator=(const PairWriter&) = delete;

  /// Appends (id, other) for each box of the runs that overlaps.
  void compare(const BoxTable& table, const SignedBounds& box, Id id, std::span<const Run> runs) {
    std::size_t candidates = 0;
    for (const Run& run : runs) candidates += run.end - run.begin;
    // Room for as many pairs again as this object has appended, and not as the vector holds. A
    // vector may get few pairs from each of many objects.
    if (pairs_.size() < count_ + candidates) pairs_.resize(2 * count_ - begin_ + candidates);
    const SignedBounds minEndpoints = computeMinEndpoints(box);
    IdPair* to = pairs_.data() + count_;
    const AppendOverlaps append = table.useAvx ? appendOverlapsAvx : appendOverlaps;
    for (const Run& run : runs)
      to = append(minEndpoints, id, table.boxes_.data() + run.begin, table.ids_.data() + run.begin,
                  run.end - run.begin, to);
    count_ = static_cast<std::size_t>(to - pairs_.data());
  }

 private:
  std::vector<IdPair>& pairs_;
  std::size_t begin_, count_;
};

void BoxTable::SizeClass::add(const SignedBounds& box, const std::array<double, 3>& extent) {
  if (count == 0) bounds = box;
  ++count;
  for (std::size_t k = 0; k < 6; ++k) bounds[k] = std::max(bounds[k], box[k]);
  for (std::size_t axis = 0; axis < 3; ++axis)
    maxExtent[axis] = std::max(maxExtent[axis], extent[axis]);
}

void BoxTable::SizeClass::add(const SizeClass& other) {
  const std::uint32_t sum = count + other.count;
  add(other.bounds, other.maxExtent);
  count = sum;
}

void BoxTable::build(std::span<const SignedBounds> maxEndpoints, std::span<const Id> ids) {
  classify(maxEndpoints, ids);
  makeLevels();
  const std::size_t cells =
      levels_.empty()
          ? 0
          : levels_.back().firstCell + static_cast<std::size_t>(levels_.back().cellCount());
  cellStart_.assign(cells + 1, 0);
  cellOfBox_.resize(ids.size());
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const Level& level = levels_[levelByExponent_[exponentOfBox_[k]]];
    const SignedBounds& box = maxEndpoints[ids[k]];
    std::array<std::int64_t, 3> at;
    for (std::size_t axis = 0; axis < 3; ++axis)
      at[axis] = wrap(toCoord(-box[axis], level.inverseEdge[axis]), level.cells[axis],
                      level.inverseCells[axis]);
    cellOfBox_[k] = static_cast<std::uint32_t>(
        level.firstCell +
        static_cast<std::size_t>((at[0] * level.cells[1] + at[1]) * level.cells[2] + at[2]));
    ++cellStart_[cellOfBox_[k]];
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& start : cellStart_) sum += std::exchange(start, sum);
  boxes_.resize(ids.size());
  ids_.resize(ids.size());
  cells_.resize(ids.size());
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const std::uint32_t at = cellStart_[cellOfBox_[k]]++;
    boxes_[at] = maxEndpoints[ids[k]];
    ids_[at] = ids[k];
    cells_[at] = cellOfBox_[k];
  }
  // Each start is now that of the next cell.
  std::copy_backward(cellStart_.begin(), cellStart_.end() - 1, cellStart_.end());
  cellStart_.front() = 0;
}

void BoxTable::classify(std::span<const SignedBounds> maxEndpoints, std::span<const Id> ids) {
  classes_.resize(kExponents);
  for (const std::uint16_t exponent : usedExponents_) classes_[exponent] = {};
  usedExponents_.clear();
  exponentOfBox_.resize(ids.size());
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const SignedBounds& box = maxEndpoints[ids[k]];
    const std::array<double, 3> extent = computeExtents(box);
    const std::size_t exponent = computeExponent(extent);
    exponentOfBox_[k] = static_cast<std::uint16_t>(exponent);
    if (classes_[exponent].count == 0)
      usedExponents_.push_back(static_cast<std::uint16_t>(exponent));
    classes_[exponent].add(box, extent);
  }
  std::sort(usedExponents_.begin(), usedExponents_.end());
}

void BoxTable::makeLevels() {
  levels_.clear();
  levelByExponent_.resize(kExponents);
  std::size_t last = 0;   // exponent of the last level's last class
  bool isMerged = false;  // the last level has two classes
  for (const std::uint16_t exponent : usedExponents_) {
    const SizeClass& added = classes_[exponent];
    const bool joins = !levels_.empty() && exponent == last + 1 && !isMerged &&
                       levels_.back().content.count <= kMergeRatio * added.count;
    if (joins) {
      levels_.back().content.add(added);
    } else {
      levels_.push_back({.content = added});
    }
    isMerged = joins;
    last = exponent;
    levelByExponent_[exponent] = static_cast<std::uint16_t>(levels_.size() - 1);
  }
  std::size_t firstCell = 0;
  for (Level& level : levels_) {
    level.firstCell = firstCell;
    sizeGrid(level);
    firstCell += static_cast<std::size_t>(level.cellCount());
  }
}

/// An edge exceeds the largest box by more than all rounding errors of toCoord(). The cells of two
/// overlapping boxes are therefore equal or adjacent.
void BoxTable::sizeGrid(Level& level) {
  std::array<double, 3> wanted, span;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low = -level.content.bounds[axis], high = level.content.bounds[axis + 3];
    const double magnitude = std::max(std::abs(low), std::abs(high));
    const double edge = level.content.maxExtent[axis] * (1 + 0x1p-20) + magnitude * 0x1p-45;
    level.inverseEdge[axis] = 1 / std::clamp(edge, 1e-300, std::numeric_limits<double>::max());
    span[axis] = static_cast<double>(toCoord(high, level.inverseEdge[axis]) -
                                     toCoord(low, level.inverseEdge[axis]) + 1);
    wanted[axis] = std::clamp(span[axis], kMinCells, kMaxCells);
  }
  const double limit = std::min(kCellsPerBox * level.content.count + 256, kMaxCells);
  while (wanted[0] * wanted[1] * wanted[2] > limit) {
    double& largest = *std::max_element(wanted.begin(), wanted.end());
    largest = std::max(kMinCells, largest * 0.8);
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    level.cells[axis] = static_cast<std::int64_t>(wanted[axis]);
    // With a prime number the boxes of a regular lattice do not fall into a few cells.
    while (level.cells[axis] < static_cast<std::int64_t>(span[axis]) && !isPrime(level.cells[axis]))
      --level.cells[axis];
    level.inverseCells[axis] = 1 / static_cast<double>(level.cells[axis]);
  }
}

void BoxTable::findPairs(std::vector<IdPair>& pairs) const {
  PairWriter writer(pairs);
  for (std::size_t fine = 0; fine < levels_.size(); ++fine) {
    findPairsInLevel(levels_[fine], writer);
    for (std::size_t coarse = fine + 1; coarse < levels_.size(); ++coarse)
      findPairsBetween(levels_[fine], levels_[coarse], writer);
  }
}

void BoxTable::findOverlaps(const SignedBounds& maxEndpoints, Id id,
                            std::vector<IdPair>& pairs) const {
  PairWriter writer(pairs);
  for (const Level& level : levels_) {
    visitNear(level, maxEndpoints,
              [&](const Run& run) { writer.compare(*this, maxEndpoints, id, std::span(&run, 1)); });
  }
}

BoxTable::Run BoxTable::getBoxes(const Level& level) const {
  return cellsAt(level.firstCell, level.firstCell + static_cast<std::size_t>(level.cellCount()));
}

void BoxTable::findPairsInLevel(const Level& level, PairWriter& writer) const {
  const auto nx = static_cast<std::size_t>(level.cells[0]),
             ny = static_cast<std::size_t>(level.cells[1]);
  for (std::size_t x = 0; x < nx; ++x)
    for (std::size_t y = 0; y < ny; ++y) findPairsInRow(level, x, y, writer);
}

/// Pairs of the boxes in a row of cells along z with each other and with the four rows after it.
/// Each of the 26 neighbours of a cell is thus visited from one side.
void BoxTable::findPairsInRow(const Level& level, std::size_t x, std::size_t y,
                              PairWriter& writer) const {
  const auto nx = static_cast<std::size_t>(level.cells[0]),
             ny = static_cast<std::size_t>(level.cells[1]),
             nz = static_cast<std::size_t>(level.cells[2]);
  const auto rowAt = [&](std::size_t rowX, std::size_t rowY) {
    return level.firstCell + (rowX * ny + rowY) * nz;
  };
  const std::size_t own = rowAt(x, y);
  const Run rowBoxes = cellsAt(own, own + nz);
  if (rowBoxes.begin == rowBoxes.end) return;
  const std::size_t nextX = x + 1 == nx ? 0 : x + 1, nextY = y + 1 == ny ? 0 : y + 1,
                    lastY = y == 0 ? ny - 1 : y - 1;
  const std::array<std::size_t, 4> after{rowAt(x, nextY), rowAt(nextX, lastY), rowAt(nextX, y),
                                         rowAt(nextX, nextY)};
  for (std::uint32_t next = rowBoxes.begin; next < rowBoxes.end;) {
    const std::size_t z = cells_[next] - own;
    const Run cell = cellsAt(own + z, own + z + 1);
    next = cell.end;
    RunList runs;
    // Cells z - 1 to z + 1; at an end of the row the third one is at the other end.
    const std::size_t low = z == 0 ? 0 : z - 1, high = z + 1 == nz ? nz : z + 2;
    runs.add({cell.begin, cellStart_[own + high]});
    for (const std::size_t row : after) runs.add(cellsAt(row + low, row + high));
    if (high - low < 3) {
      const std::size_t third = z == 0 ? nz - 1 : 0;
      for (const std::size_t row : after) runs.add(cellsAt(row + third, row + third + 1));
      if (third == 0) runs.add(cellsAt(own, own + 1));
    }
    for (std::uint32_t k = cell.begin; k < cell.end; ++k) {
      ++runs.all[0].begin;
      writer.compare(*this, boxes_[k], ids_[k], runs.span());
    }
  }
}

/// Visits all boxes of a level whose cells are near enough for an overlap.
template <typename Visit>
void BoxTable::visitNear(const Level& level, const SignedBounds& box, const Visit& visit) const {
  std::array<std::size_t, 3> first, count, cells;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t low = toCoord(-box[axis], level.inverseEdge[axis]) - 1,
                       high = toCoord(box[axis + 3], level.inverseEdge[axis]);
    const bool isAll = high - low + 1 >= level.cells[axis];
    cells[axis] = static_cast<std::size_t>(level.cells[axis]);
    count[axis] = isAll ? cells[axis] : static_cast<std::size_t>(high - low + 1);
    first[axis] =
        isAll ? 0
              : static_cast<std::size_t>(wrap(low, level.cells[axis], level.inverseCells[axis]));
  }
  if (count[0] * count[1] >= level.content.count) return visit(getBoxes(level));  // few boxes
  const std::size_t endZ = std::min(first[2] + count[2], cells[2]),
                    wrappedZ = first[2] + count[2] - endZ;
  for (std::size_t i = 0, x = first[0]; i < count[0]; ++i, x = x + 1 == cells[0] ? 0 : x + 1) {
    for (std::size_t j = 0, y = first[1]; j < count[1]; ++j, y = y + 1 == cells[1] ? 0 : y + 1) {
      const std::size_t row = level.firstCell + (x * cells[1] + y) * cells[2];
      visit(cellsAt(row + first[2], row + endZ));
      if (wrappedZ > 0) visit(cellsAt(row, row + wrappedZ));
    }
  }
}

/// From the side that visits fewer rows of cells.
void BoxTable::findPairsBetween(const Level& fine, const Level& coarse, PairWriter& writer) const {
  constexpr double kRowsOfFineBox = 9;
  double rowsOfCoarseBox = 1;
  for (const std::size_t axis : {0u, 1u}) {
    rowsOfCoarseBox *= std::min(coarse.content.maxExtent[axis] * fine.inverseEdge[axis] + 2,
                                static_cast<double>(fine.cells[axis]));
  }
  const bool fromFine =
      fine.content.count * kRowsOfFineBox < coarse.content.count * rowsOfCoarseBox;
  const Run sources = getBoxes(fromFine ? fine : coarse);
  for (std::uint32_t k = sources.begin; k < sources.end; ++k) {
    visitNear(fromFine ? coarse : fine, boxes_[k], [&](const Run& run) {
      writer.compare(*this, boxes_[k], ids_[k], std::span(&run, 1));
    });
  }
}

}  // namespace enfilade::collision
