// After T. Luft, C. Colditz, O. Deussen 2006, "Image enhancement by unsharp masking the depth
// buffer", but exact on planes: the inverse of the distance (in a parallel picture the distance
// itself) is affine over the picture wherever a surface is flat, so the mean of two opposite
// neighbours differs from the middle only where surfaces meet.
//
// 1. Every second pixel of every second row is a point. Each looks at two pairs of opposite
//    neighbours; how much nearer their mean is than the point, as a slope, is its shade.
// 2. Directions and ways differ within each 4 x 4 points, and shades are averaged over as many (M.
//    Mittring 2007, "Finding next gen: CryEngine 2"): all that is near counts, and no outline is
//    repeated beside itself.
// 3. A pixel between points takes the shade of those that lie as far as it does.
//
// Loops over rows have no branches, so that compilers make them vectors.
#include "render/ambient_occlusion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/camera_basis.hpp"

namespace enfilade::render {
namespace {

constexpr float kRadius = 0.30f;                      // metres around a point that can darken it
constexpr float kFewestPixels = 2, kMostPixels = 48;  // that the radius may come to
constexpr float kStrength = 0.36f;  // what the deepest hollow takes from a colour, as sRGB
// The slopes between which what is in front ceases to count as joined to what is behind.
constexpr float kJoined = 0.6f, kApart = 1.7f;
// Of the distance, or in a parallel picture metres: what differs by less shares its shade.
constexpr float kSamePlace = 0.05f;
constexpr float kNothing = 1e30f;    // metres
constexpr std::size_t kPattern = 4;  // points after which directions come again, on both axes
constexpr std::size_t kPairs = 2;    // of neighbours
using Pairs = std::array<float, kPairs>;

/// Where the pairs of neighbours of a point lie, in parts of the radius.
struct Ways {
  Pairs x, y, length;
};

/// Two directions, square to one another, a long way and a short one.
Ways waysOf(unsigned number) {
  constexpr double kQuarter = 1.5707963267948966;  // radians
  // Neighbouring points take directions and ways that lie far from one another.
  const double turn = (5 * number % 16 + 0.5) / 16, stretch = (7 * number % 16 + 0.5) / 16;
  Ways ways;
  for (std::size_t i = 0; i < kPairs; ++i) {
    const double angle = kQuarter * (static_cast<double>(i) + turn);
    const double length = i == 0 ? 0.55 + 0.45 * stretch : 0.1 + 0.45 * stretch;
    ways.x[i] = static_cast<float>(length * std::cos(angle));
    ways.y[i] = static_cast<float>(length * std::sin(angle));
    ways.length[i] = static_cast<float>(length);
  }
  return ways;
}

const std::array<Ways, kPattern * kPattern>& pattern() {
  static const auto all = [] {
    std::array<Ways, kPattern * kPattern> made;
    for (unsigned i = 0; i < made.size(); ++i) made[i] = waysOf(i);
    return made;
  }();
  return all;
}

float shadeOfSlope(float slope) {
  const float t = std::clamp((slope - kJoined) / (kApart - kJoined), 0.0f, 1.0f);
  return std::clamp(slope, 0.0f, 1.0f) * (1 - t * t * (3 - 2 * t));
}

float sameWithin(float distance, bool parallel) {
  return kSamePlace * (parallel ? 1.0f : distance);
}

/// The points of a picture.
struct Grid {
  std::size_t columns, rows;
  bool parallel;
  float scale;                  ///< points a metre, in a perspective at a distance of 1 m
  std::vector<float> nearness;  ///< affine on planes, ascending towards the eye
};

/// The shades of points, row by row.
class Slopes {
 public:
  explicit Slopes(const Grid& grid);

  void shadeRow(std::size_t j, std::span<float> shades);

 private:
  /// Of a pair of neighbours, for each point of a row.
  struct PairRow {
    std::vector<float> x, y, length;
  };

  void stepRow(const PairRow& ways, float roomY);

  const Grid& grid_;
  std::array<std::array<PairRow, kPairs>, kPattern> ways_;  ///< of the rows of the pattern
  std::vector<float> roomX_;                                ///< points to the nearer side
  std::vector<float> radius_, mean_;
  std::vector<int> step_;  ///< from a point to the one neighbour; to the other it is the opposite
};

Slopes::Slopes(const Grid& grid)
    : grid_(grid), radius_(grid.columns), mean_(grid.columns), step_(grid.columns) {
  for (std::size_t i = 0; i < grid.columns; ++i)
    roomX_.push_back(static_cast<float>(std::min(i, grid.columns - 1 - i)));
  for (std::size_t j = 0; j < kPattern; ++j) {
    for (std::size_t k = 0; k < kPairs; ++k) {
      PairRow& row = ways_[j][k];
      for (std::size_t i = 0; i < grid.columns; ++i) {
        const Ways& ways = pattern()[j * kPattern + i % kPattern];
        row.x.push_back(ways.x[k]);
        row.y.push_back(ways.y[k]);
        row.length.push_back(ways.length[k]);
      }
    }
  }
}

/// Both neighbours lie in the picture.
void Slopes::stepRow(const PairRow& ways, float roomY) {
  constexpr float kAbove = 4096.5f;  // more than any picture has points; truncating then rounds
  const int columns = static_cast<int>(grid_.columns);
  const auto rounded = [](float way, float room) {
    return static_cast<int>(std::min(std::max(way, -room), room) + kAbove) - 4096;
  };
  for (std::size_t i = 0; i < step_.size(); ++i) {
    const int x = rounded(ways.x[i] * radius_[i], roomX_[i]);
    step_[i] = columns * rounded(ways.y[i] * radius_[i], roomY) + x;
  }
}

void Slopes::shadeRow(std::size_t j, std::span<float> shades) {
  const float* near = &grid_.nearness[j * grid_.columns];
  const bool parallel = grid_.parallel;
  const float scale = grid_.scale;
  for (std::size_t i = 0; i < shades.size(); ++i) {
    radius_[i] = std::clamp(kRadius * scale * (parallel ? 1.0f : near[i]), kFewestPixels / 2,
                            kMostPixels / 2);
    shades[i] = 0;
  }
  const auto roomY = static_cast<float>(std::min(j, grid_.rows - 1 - j));
  for (const PairRow& ways : ways_[j % kPattern]) {
    stepRow(ways, roomY);
    for (std::size_t i = 0; i < shades.size(); ++i)
      mean_[i] =
          0.5f * (near[static_cast<int>(i) + step_[i]] + near[static_cast<int>(i) - step_[i]]);
    for (std::size_t i = 0; i < shades.size(); ++i) {
      const float rise = (mean_[i] - near[i]) / (parallel ? 1.0f : std::max(mean_[i], 1e-30f));
      const float way = std::max(ways.length[i] * radius_[i], 1.0f);
      shades[i] += shadeOfSlope(rise * scale / way) / kPairs;
    }
  }
}

/// Values of points and their sums while they are averaged.
struct Averages {
  const std::vector<float>& places;
  bool parallel;
  std::vector<float> shades, sums, counts;

  /// Adds to `count` points from `first` on those that lie `step` points farther, where these are
  /// in about the same place.
  void add(std::size_t first, std::size_t count, std::ptrdiff_t step, float share) {
    const float* place = &places[first];
    const float* otherPlace = place + step;
    const float* otherShade = &shades[first] + step;
    float* sum = &sums[first];
    float* all = &counts[first];
    for (std::size_t i = 0; i < count; ++i) {
      const float within = sameWithin(place[i], parallel);
      const float part = std::abs(otherPlace[i] - place[i]) <= within ? share : 0.0f;
      sum[i] += part * otherShade[i];
      all[i] += part;
    }
  }
  void divide() {
    for (std::size_t i = 0; i < shades.size(); ++i) shades[i] = sums[i] / counts[i];
    std::fill(sums.begin(), sums.end(), 0.0f);
    std::fill(counts.begin(), counts.end(), 0.0f);
  }
};

/// Over two points to both sides, of which the outer ones count a half: four in all; along rows,
/// then along columns.
void average(Averages& of, std::size_t columns, std::size_t rows) {
  constexpr std::array<float, 5> kShares{0.5f, 1, 1, 1, 0.5f};
  for (std::size_t k = 0; k < kShares.size(); ++k) {
    const std::size_t before = k < 2 ? 2 - k : 0, after = k > 2 ? k - 2 : 0;
    if (before + after >= columns) continue;
    for (std::size_t j = 0; j < rows; ++j)
      of.add(j * columns + before, columns - before - after, static_cast<std::ptrdiff_t>(k) - 2,
             kShares[k]);
  }
  of.divide();
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t k = 0; k < kShares.size(); ++k) {
      if (j + k < 2 || j + k >= rows + 2) continue;
      of.add(j * columns, columns, static_cast<std::ptrdiff_t>(columns) * (static_cast<int>(k) - 2),
             kShares[k]);
    }
  }
  of.divide();
}

/// A mean of two, by how near their places are to `place`; of each a little at least.
float between(float place, float within, float placeA, float a, float placeB, float b) {
  const float shareA = 1e-3f + std::max(0.0f, 1 - std::abs(placeA - place) / within);
  const float shareB = 1e-3f + std::max(0.0f, 1 - std::abs(placeB - place) / within);
  return (shareA * a + shareB * b) / (shareA + shareB);
}

}  // namespace

Hollows::Hollows(const std::vector<float>& depth, const Camera& camera)
    : depth_(depth),
      width_(static_cast<std::size_t>(camera.width)),
      parallel_(camera.projection == Camera::Projection::orthographic),
      columns_((width_ + 1) / 2) {
  const std::size_t rows = (static_cast<std::size_t>(camera.height) + 1) / 2;
  const std::size_t points = columns_ * rows;
  places_.resize(points);
  for (std::size_t j = 0; j < rows; ++j) {
    const float* row = &depth[2 * j * width_];
    float* place = &places_[j * columns_];
    for (std::size_t i = 0; i < columns_; ++i)
      place[i] = std::isnan(row[2 * i]) ? kNothing : row[2 * i];
  }
  Grid grid{columns_, rows, parallel_, static_cast<float>(viewOf(camera).scaleY) / 4, {}};
  grid.scale *= static_cast<float>(camera.height);
  grid.nearness.resize(points);
  const auto far = static_cast<float>(camera.far);
  for (std::size_t i = 0; i < points; ++i)
    grid.nearness[i] = parallel_ ? -std::min(places_[i], far) : 1 / places_[i];
  Averages shades{places_, parallel_, std::vector<float>(points), std::vector<float>(points),
                  std::vector<float>(points)};
  Slopes slopes(grid);
  for (std::size_t j = 0; j < rows; ++j)
    slopes.shadeRow(j, std::span(shades.shades).subspan(j * columns_, columns_));
  for (std::size_t i = 0; i < points; ++i)
    shades.shades[i] = places_[i] < kNothing ? shades.shades[i] : 0.0f;
  average(shades, columns_, rows);
  shadows_ = std::move(shades.shades);
  for (float& shadow : shadows_) shadow *= 255 * kStrength;
}

void Hollows::row(int y, std::span<std::uint8_t> left) const {
  const auto row = static_cast<std::size_t>(y);
  // The points of the row; of an odd one what the rows above and below say of them. And the pixels
  // between them, after each point one.
  const std::size_t count = width_ / 2;
  std::vector<float> points(columns_ + 1), shadows(columns_ + 1), others(count),
      otherShadows(count);
  const float* depth = &depth_[row * width_];
  const auto placeAt = [&](std::size_t x) { return std::isnan(depth[x]) ? kNothing : depth[x]; };
  for (std::size_t i = 0; i < columns_; ++i) points[i] = placeAt(2 * i);
  for (std::size_t i = 0; i < count; ++i) others[i] = placeAt(2 * i + 1);
  const std::size_t above = row / 2 * columns_;
  const std::size_t last = places_.size() - columns_;
  const std::size_t below = std::min((row + 1) / 2 * columns_, last);
  for (std::size_t i = 0; i < columns_; ++i) {
    shadows[i] = between(points[i], sameWithin(points[i], parallel_), places_[above + i],
                         shadows_[above + i], places_[below + i], shadows_[below + i]);
  }
  points[columns_] = kNothing;
  shadows[columns_] = 0;
  for (std::size_t i = 0; i < count; ++i) {
    otherShadows[i] = between(others[i], sameWithin(others[i], parallel_), points[i], shadows[i],
                              points[i + 1], shadows[i + 1]);
  }
  const auto byte = [](float shadow) {
    return static_cast<std::uint8_t>(static_cast<int>(255.5f - shadow));
  };
  for (std::size_t i = 0; i < count; ++i) {
    left[2 * i] = byte(shadows[i]);
    left[2 * i + 1] = byte(otherShadows[i]);
  }
  if (count < columns_) left[2 * count] = byte(shadows[count]);
}

}  // namespace enfilade::render
