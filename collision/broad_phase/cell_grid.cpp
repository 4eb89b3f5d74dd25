// How the cells are laid.
//
// 1. The edge of the finest cells is measured (finestEdge): the smallest at which a box still lies
//    in few cells on average, which bounds memory, and in company, which bounds the cells that are
//    looked up for a mover beside the boxes found there. Both are means over samples: they steer
//    cost, never an answer.
// 2. Each coarser level has cells four times as wide. A box goes to the finest level on which it
//    lies in at most kMostCells cells, so a floor slab or a terrain costs no more than a chair.
// 3. The last level is one cell; what suits no other level lies there.

#include "collision/broad_phase/cell_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace enfilade::collision {
namespace {

constexpr double kMostEntries = 1.8;   // cells a box, on average, on the finest level
constexpr double kLeastCompany = 12;   // boxes in a box' cell, on average
constexpr int kLevelBits = 2;          // a level's cells are 2^this as wide as the next finer ones
constexpr double kOutermost = 0x1p30;  // place of the outermost cells
constexpr std::size_t kSampledBoxes = 16384;
constexpr int kEdgeSteps = 116;  // of the fourth root of 2: down to 2^-28.75 of the widest

std::uint64_t mixed(std::uint64_t x) {  // the finaliser of SplitMix64
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9u;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

Box boundsOf(std::span<const Box> boxes) {
  Box bounds;
  for (const Box& box : boxes) bounds.include(box);
  return bounds;
}

/// Cells a box lies in, on average over where it may stand in the grid.
double meanEntries(std::span<const Box> boxes, double edge) {
  const std::size_t stride = 1 + boxes.size() / kSampledBoxes;
  double sum = 0, count = 0;
  for (std::size_t at = 0; at < boxes.size(); at += stride) {
    const Vec3 size = boxes[at].size() / edge;
    sum += std::min(CellGrid::kMostCells, (1 + size.x()) * (1 + size.y()) * (1 + size.z()));
    count += 1;
  }
  return sum / count;
}

/// The boxes, or so many that are picked by chance (by hash, lest a pattern of theirs matters).
std::vector<Vec3> sampledCorners(std::span<const Box> boxes, const Vec3& origin) {
  const std::uint64_t onePickedOf = 1 + boxes.size() / kSampledBoxes;
  std::vector<Vec3> corners;
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    if (mixed(k) % onePickedOf == 0) corners.push_back(boxes[k].min - origin);
  }
  return corners;
}

/// Boxes in the cell of a box' lower corner, on average over the boxes. A pair of boxes is sampled
/// with the square of the sampled share, so that pairs in the sample tell of pairs in the whole.
double meanCompany(std::span<const Vec3> corners, double share, double edge) {
  std::vector<std::uint64_t> keys;
  const double inverse = 1 / edge;
  for (const Vec3& corner : corners) {
    const Vec3 place = (corner * inverse).cwiseMin(kOutermost);
    keys.push_back(
        hashOf(0, {static_cast<std::int32_t>(place.x()), static_cast<std::int32_t>(place.y()),
                   static_cast<std::int32_t>(place.z())}));
  }
  std::sort(keys.begin(), keys.end());
  double pairs = 0;
  for (std::size_t first = 0, last = 0; first < keys.size(); first = last) {
    while (last < keys.size() && keys[last] == keys[first]) ++last;
    pairs += static_cast<double>(last - first) * static_cast<double>(last - first - 1);
  }
  return 1 + pairs / (share * static_cast<double>(keys.size()));
}

double finestEdge(std::span<const Box> boxes, const Vec3& origin, double widest) {
  if (!(widest > 1e-290)) return 1;
  const std::vector<Vec3> corners = sampledCorners(boxes, origin);
  if (corners.empty()) return widest;
  const double share = static_cast<double>(corners.size()) / static_cast<double>(boxes.size());
  const auto edgeAt = [widest](int step) {  // widest * 2^(-step / 4)
    constexpr std::array<double, 4> kRoots{1, 0.8408964152537145, 0.7071067811865476,
                                           0.5946035575013605};
    return std::ldexp(widest * kRoots[static_cast<std::size_t>(step % 4)], -(step / 4));
  };
  const auto wideEnough = [&](double edge) {
    return meanEntries(boxes, edge) <= kMostEntries &&
           meanCompany(corners, share, edge) >= kLeastCompany;
  };
  int good = 0, bad = kEdgeSteps;
  while (bad - good > 1) {
    const int middle = (good + bad) / 2;
    (wideEnough(edgeAt(middle)) ? good : bad) = middle;
  }
  return edgeAt(good);
}

}  // namespace

std::uint64_t hashOf(std::size_t level, const CellPlace& at) {
  const auto word = [](std::int32_t v) { return std::uint64_t{static_cast<std::uint32_t>(v)}; };
  return mixed((word(at[0]) | word(at[1]) << 32) * 0x9e3779b97f4a7c15u +
               (word(at[2]) | std::uint64_t{level} << 32) * 0xd6e8feb86659fd93u);
}

CellGrid::CellGrid(std::span<const Box> boxes) {
  double widest = 0;
  if (!boxes.empty()) {
    const Box bounds = boundsOf(boxes);
    origin_ = {bounds.min.x(), bounds.min.y(), bounds.min.z()};
    widest = std::min(bounds.size().maxCoeff(), 1e300);
    edge_ = finestEdge(boxes, bounds.min, widest);
    inverseEdge_ = 1 / edge_;
  }
  for (double edge = edge_; edge < widest; edge *= 1 << kLevelBits) ++levelCount_;
}

std::int64_t CellGrid::finePlaceOf(std::size_t axis, double x) const {
  constexpr double kFine = 1 << kFineBits;
  const double offset = std::clamp(x - origin_[axis], -1.7e308, 1.7e308);  // lest 0 * infinity
  const double place = kFine * std::clamp(offset * inverseEdge_, -kOutermost, kOutermost);
  const auto truncated = static_cast<std::int64_t>(place);
  return truncated - (place < static_cast<double>(truncated) ? 1 : 0);
}

FinePlaces CellGrid::finePlacesOf(const HalfAxes& reach) const {
  FinePlaces places;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    places[axis] = -finePlaceOf(axis, -reach[axis]);
    places[axis + 3] = finePlaceOf(axis, reach[axis + 3]);
  }
  return places;
}

FinePlaces CellGrid::onLevel(std::size_t level, const FinePlaces& finest) const {
  FinePlaces places{};
  if (level + 1 == levelCount_) return places;  // the cell that holds all of space
  for (std::size_t axis = 0; axis < 3; ++axis) {
    places[axis] = -(-finest[axis] >> (kLevelBits * level));
    places[axis + 3] = finest[axis + 3] >> (kLevelBits * level);
  }
  return places;
}

std::size_t CellGrid::levelFor(FinePlaces& places) const {
  const FinePlaces finest = places;
  std::size_t level = 0;
  for (;; ++level) {  // on the last level everything lies in the one cell
    places = onLevel(level, finest);
    if (rangeOf(places).count() <= kMostCells) return level;
  }
}

}  // namespace enfilade::collision
