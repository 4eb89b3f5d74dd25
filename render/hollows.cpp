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
#include "render/hollows.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/view.hpp"

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

  float shadeAt(std::size_t i, std::size_t j) const;
};

float Grid::shadeAt(std::size_t i, std::size_t j) const {
  const float* here = &nearness[j * columns + i];
  const float near = *here;
  const float radius =
      std::clamp(kRadius * scale * (parallel ? 1.0f : near), kFewestPixels / 2, kMostPixels / 2);
  // Both neighbours lie in the picture.
  const auto roomX = static_cast<float>(std::min(i, columns - 1 - i)),
             roomY = static_cast<float>(std::min(j, rows - 1 - j));
  const Ways& ways = pattern()[j % kPattern * kPattern + i % kPattern];
  constexpr float kAbove = 4096.5f;  // more than any picture has points; truncating then rounds
  std::array<int, kPairs> x, y;
  for (std::size_t k = 0; k < kPairs; ++k) {
    x[k] = static_cast<int>(std::min(std::max(ways.x[k] * radius, -roomX), roomX) + kAbove) - 4096;
    y[k] = static_cast<int>(std::min(std::max(ways.y[k] * radius, -roomY), roomY) + kAbove) - 4096;
  }
  Pairs mean;
  for (std::size_t k = 0; k < kPairs; ++k) {
    const std::ptrdiff_t step = static_cast<std::ptrdiff_t>(columns) * y[k] + x[k];
    mean[k] = 0.5f * (here[step] + here[-step]);
  }
  float sum = 0;
  for (std::size_t k = 0; k < kPairs; ++k) {
    const float rise = (mean[k] - near) / (parallel ? 1.0f : std::max(mean[k], 1e-30f));
    sum += shadeOfSlope(rise * scale / std::max(ways.length[k] * radius, 1.0f));
  }
  return sum / kPairs;
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
  for (std::size_t j = 0, point = 0; j < rows; ++j) {
    for (std::size_t i = 0; i < columns_; ++i, ++point)
      if (places_[point] < kNothing) shades.shades[point] = grid.shadeAt(i, j);
  }
  average(shades, columns_, rows);
  shadows_ = std::move(shades.shades);
  for (float& shadow : shadows_) shadow *= 255 * kStrength;
}

void Hollows::row(int y, std::span<std::uint8_t> left) const {
  const auto row = static_cast<std::size_t>(y);
  // The points of the row; of an odd one what the rows above and below say of them.
  std::vector<float> places(width_ + 1), shadows(columns_ + 1);
  for (std::size_t x = 0; x < width_; ++x) {
    const float z = depth_[row * width_ + x];
    places[x] = std::isnan(z) ? kNothing : z;
  }
  const std::size_t above = row / 2 * columns_;
  const std::size_t last = places_.size() - columns_;
  const std::size_t below = std::min((row + 1) / 2 * columns_, last);
  for (std::size_t i = 0; i < columns_; ++i) {
    const float place = places[2 * i];
    shadows[i] = between(place, sameWithin(place, parallel_), places_[above + i],
                         shadows_[above + i], places_[below + i], shadows_[below + i]);
  }
  places[width_] = kNothing;
  shadows[columns_] = 0;
  for (std::size_t x = 0; x < width_; x += 2)
    left[x] = static_cast<std::uint8_t>(255.5f - shadows[x / 2]);
  for (std::size_t x = 1; x < width_; x += 2) {
    const float place = places[x];
    const float shadow = between(place, sameWithin(place, parallel_), places[x - 1], shadows[x / 2],
                                 places[x + 1], shadows[x / 2 + 1]);
    left[x] = static_cast<std::uint8_t>(255.5f - shadow);
  }
}

}  // namespace enfilade::render
