// Choice of the cell sizes.
//
// 1. The edge of the finest cells (chooseFinestEdge) is the smallest that meets two conditions. A
//    box lies in few cells on average, which bounds memory. A cell holds several boxes on average,
//    which bounds the number of cell lookups per box found. Both are means over samples: they
//    influence cost, never a result.
// 2. Each coarser level has cells four times as wide. A box goes to the finest level on which it
//    lies in at most kMaxCells cells. A floor slab or a terrain therefore costs no more than a
//    chair.
// 3. The last level is a single cell for boxes that fit no other level.

#include "collision/broad_phase/cell_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

constexpr double kMaxMeanEntries = 1.8;   // mean number of cells per box on the finest level
constexpr double kMinMeanOccupancy = 12;  // mean number of boxes in the cell of a box
constexpr int kLevelBits = 2;             // log2 of the ratio of the cell widths of two levels
constexpr double kMaxCoord = 0x1p30;      // coordinate of the outermost cells
constexpr std::size_t kSampledBoxes = 16384;
constexpr int kEdgeSteps = 116;  // steps of 2^(1/4): down to 2^-28.75 of the scene size

std::uint64_t mixBits(std::uint64_t x) {  // finaliser of SplitMix64
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9u;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

Aabb computeBounds(std::span<const Aabb> boxes) {
  Aabb bounds;
  for (const Aabb& box : boxes) bounds.include(box);
  return bounds;
}

/// Mean number of cells per box, averaged over its position relative to the grid.
double computeMeanEntries(std::span<const Aabb> boxes, double edge) {
  const std::size_t stride = 1 + boxes.size() / kSampledBoxes;
  double sum = 0, count = 0;
  for (std::size_t at = 0; at < boxes.size(); at += stride) {
    const Vec3 size = boxes[at].size() / edge;
    sum += std::min(CellGrid::kMaxCells, (1 + size.x()) * (1 + size.y()) * (1 + size.z()));
    count += 1;
  }
  return sum / count;
}

/// Lower corners of the boxes, or of a random sample. The sample is by hash, so that a pattern in
/// the order of the boxes has no influence.
std::vector<Vec3> sampleCorners(std::span<const Aabb> boxes, const Vec3& origin) {
  const std::uint64_t onePickedOf = 1 + boxes.size() / kSampledBoxes;
  std::vector<Vec3> corners;
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    if (mixBits(k) % onePickedOf == 0) corners.push_back(boxes[k].min - origin);
  }
  return corners;
}

/// Mean number of boxes in the cell of a box' lower corner. `share` is the sampled fraction of the
/// boxes; a pair is sampled with its square, which is used to extrapolate the number of pairs.
double computeMeanOccupancy(std::span<const Vec3> corners, double share, double edge) {
  ENFILADE_ASSERT(!corners.empty() && share > 0 && share <= 1);
  std::vector<std::uint64_t> keys;
  const double inverse = 1 / edge;
  for (const Vec3& corner : corners) {
    const Vec3 coords = (corner * inverse).cwiseMin(kMaxCoord);
    keys.push_back(
        hashCell(0, {static_cast<std::int32_t>(coords.x()), static_cast<std::int32_t>(coords.y()),
                     static_cast<std::int32_t>(coords.z())}));
  }
  std::sort(keys.begin(), keys.end());
  double pairs = 0;
  for (std::size_t first = 0, last = 0; first < keys.size(); first = last) {
    while (last < keys.size() && keys[last] == keys[first]) ++last;
    pairs += static_cast<double>(last - first) * static_cast<double>(last - first - 1);
  }
  return 1 + pairs / (share * static_cast<double>(keys.size()));
}

double chooseFinestEdge(std::span<const Aabb> boxes, const Vec3& origin, double maxSize) {
  if (!(maxSize > 1e-290)) return 1;
  const std::vector<Vec3> corners = sampleCorners(boxes, origin);
  if (corners.empty()) return maxSize;
  const double share = static_cast<double>(corners.size()) / static_cast<double>(boxes.size());
  const auto edgeAt = [maxSize](int step) {  // widest * 2^(-step / 4)
    constexpr std::array<double, 4> kRoots{1, 0.8408964152537145, 0.7071067811865476,
                                           0.5946035575013605};
    return std::ldexp(maxSize * kRoots[static_cast<std::size_t>(step % 4)], -(step / 4));
  };
  const auto wideEnough = [&](double edge) {
    return computeMeanEntries(boxes, edge) <= kMaxMeanEntries &&
           computeMeanOccupancy(corners, share, edge) >= kMinMeanOccupancy;
  };
  int good = 0, bad = kEdgeSteps;
  while (bad - good > 1) {
    const int middle = (good + bad) / 2;
    (wideEnough(edgeAt(middle)) ? good : bad) = middle;
  }
  return edgeAt(good);
}

}  // namespace

std::uint64_t hashCell(std::size_t level, const CellCoords& at) {
  const auto word = [](std::int32_t v) { return std::uint64_t{static_cast<std::uint32_t>(v)}; };
  return mixBits((word(at[0]) | word(at[1]) << 32) * 0x9e3779b97f4a7c15u +
                 (word(at[2]) | std::uint64_t{level} << 32) * 0xd6e8feb86659fd93u);
}

CellGrid::CellGrid(std::span<const Aabb> boxes) {
  double maxSize = 0;
  if (!boxes.empty()) {
    const Aabb bounds = computeBounds(boxes);
    origin_ = {bounds.min.x(), bounds.min.y(), bounds.min.z()};
    maxSize = std::min(bounds.size().maxCoeff(), 1e300);
    edge_ = chooseFinestEdge(boxes, bounds.min, maxSize);
    inverseEdge_ = 1 / edge_;
    ENFILADE_ASSERT(edge_ > 0 && std::isfinite(inverseEdge_));
  }
  for (double edge = edge_; edge < maxSize; edge *= 1 << kLevelBits) ++levelCount_;
}

std::int64_t CellGrid::toFineCoord(std::size_t axis, double x) const {
  constexpr double kFine = 1 << kFineBits;
  const double offset = std::clamp(x - origin_[axis], -1.7e308, 1.7e308);  // avoids 0 * infinity
  const double coord = kFine * std::clamp(offset * inverseEdge_, -kMaxCoord, kMaxCoord);
  const auto truncated = static_cast<std::int64_t>(coord);
  return truncated - (coord < static_cast<double>(truncated) ? 1 : 0);
}

FineCoords CellGrid::toFineCoords(const SignedBounds& maxEndpoints) const {
  FineCoords fineCoords;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    fineCoords[axis] = -toFineCoord(axis, -maxEndpoints[axis]);
    fineCoords[axis + 3] = toFineCoord(axis, maxEndpoints[axis + 3]);
  }
  return fineCoords;
}

FineCoords CellGrid::toLevel(std::size_t level, const FineCoords& finest) const {
  ENFILADE_ASSERT(level < levelCount_);
  FineCoords fineCoords{};
  if (level + 1 == levelCount_) return fineCoords;  // the single cell of all of space
  for (std::size_t axis = 0; axis < 3; ++axis) {
    fineCoords[axis] = -(-finest[axis] >> (kLevelBits * level));
    fineCoords[axis + 3] = finest[axis + 3] >> (kLevelBits * level);
  }
  return fineCoords;
}

std::size_t CellGrid::chooseLevel(FineCoords& fineCoords) const {
  const FineCoords finest = fineCoords;
  std::size_t level = 0;
  for (;; ++level) {  // ends: the last level has one cell
    fineCoords = toLevel(level, finest);
    if (toCellRange(fineCoords).count() <= kMaxCells) return level;
  }
}

}  // namespace enfilade::collision
