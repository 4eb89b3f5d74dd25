// After T. Luft, C. Colditz, O. Deussen 2006, "Image enhancement by unsharp masking the depth
// buffer", but exact on planes. On a plane, the inverse distance (orthographic: the distance) is
// affine in the image. The mean of two opposite neighbours therefore differs from the centre only
// where surfaces meet.
//
// 1. Every second pixel of every second row is a sample with two pairs of opposite neighbours. Its
//    occlusion is the slope by which the neighbours' mean is nearer than the sample.
// 2. Directions and radii vary within each 4 x 4 samples, and occlusion is averaged over as many
//    to avoid repeated outlines (M. Mittring 2007, "Finding next gen: CryEngine 2").
// 3. A pixel between samples interpolates the samples at a similar depth.
//
// Loops over rows have no branches, so that compilers vectorise them.
#include "render/ambient_occlusion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/assert.hpp"
#include "render/camera/camera.hpp"

namespace enfilade::render {
namespace {

constexpr float kRadius = 0.30f;  // metres around a sample that occlude it
constexpr float kMinRadiusPixels = 2, kMaxRadiusPixels = 48;  // limits of the radius in the image
constexpr float kStrength = 0.36f;  // fraction of the sRGB value that full occlusion removes
// Between these slopes, a foreground surface fades from adjoining to separate.
constexpr float kJoinedSlope = 0.6f, kSeparatedSlope = 1.7f;
// Fraction of the distance (orthographic: metres). Closer samples share their occlusion.
constexpr float kDepthTolerance = 0.05f;
constexpr float kNoSurface = 1e30f;      // metres
constexpr std::size_t kPatternSize = 4;  // samples per period of the directions, on both axes
constexpr std::size_t kPairCount = 2;    // of opposite neighbours
using PairValues = std::array<float, kPairCount>;

/// Offsets of a sample's neighbour pairs, as fractions of the radius.
struct SampleOffsets {
  PairValues x, y, length;
};

/// Two orthogonal directions: one long offset and one short one.
SampleOffsets makeSampleOffsets(unsigned number) {
  constexpr double kQuarter = 1.5707963267948966;  // radians
  // Neighbouring samples get very different directions and lengths.
  const double rotation = (5 * number % 16 + 0.5) / 16, spread = (7 * number % 16 + 0.5) / 16;
  SampleOffsets offsets;
  for (std::size_t i = 0; i < kPairCount; ++i) {
    const double angle = kQuarter * (static_cast<double>(i) + rotation);
    const double length = i == 0 ? 0.55 + 0.45 * spread : 0.1 + 0.45 * spread;
    offsets.x[i] = static_cast<float>(length * std::cos(angle));
    offsets.y[i] = static_cast<float>(length * std::sin(angle));
    offsets.length[i] = static_cast<float>(length);
  }
  return offsets;
}

const std::array<SampleOffsets, kPatternSize * kPatternSize>& samplePattern() {
  static const auto all = [] {
    std::array<SampleOffsets, kPatternSize * kPatternSize> table;
    for (unsigned i = 0; i < table.size(); ++i) table[i] = makeSampleOffsets(i);
    return table;
  }();
  return all;
}

float computeSlopeOcclusion(float slope) {
  const float t = std::clamp((slope - kJoinedSlope) / (kSeparatedSlope - kJoinedSlope), 0.0f, 1.0f);
  return std::clamp(slope, 0.0f, 1.0f) * (1 - t * t * (3 - 2 * t));
}

float computeDepthTolerance(float distance, bool parallel) {
  return kDepthTolerance * (parallel ? 1.0f : distance);
}

/// The sample grid of a frame.
struct SampleGrid {
  std::size_t columns, rows;
  bool parallel;
  float scale;                     ///< samples per metre; perspective: at a distance of 1 m
  std::vector<float> affineDepth;  ///< affine on planes, increasing towards the eye
};

/// Computes the occlusion of the samples, row by row.
class OcclusionSampler {
 public:
  explicit OcclusionSampler(const SampleGrid& grid);

  void sampleRow(std::size_t j, std::span<float> occlusion);

 private:
  /// Offsets of one neighbour pair, for each sample of a row.
  struct PairRow {
    std::vector<float> x, y, length;
  };

  void computeSteps(const PairRow& offsets, float borderDistanceY);

  const SampleGrid& grid_;
  std::array<std::array<PairRow, kPairCount>, kPatternSize> offsets_;  ///< per row of the pattern
  std::vector<float> borderDistanceX_;  ///< samples to the nearer side
  std::vector<float> radius_, mean_;
  std::vector<int> step_;  ///< index offset to one neighbour; the other's is its negative
};

OcclusionSampler::OcclusionSampler(const SampleGrid& grid)
    : grid_(grid), radius_(grid.columns), mean_(grid.columns), step_(grid.columns) {
  for (std::size_t i = 0; i < grid.columns; ++i)
    borderDistanceX_.push_back(static_cast<float>(std::min(i, grid.columns - 1 - i)));
  for (std::size_t j = 0; j < kPatternSize; ++j) {
    for (std::size_t k = 0; k < kPairCount; ++k) {
      PairRow& row = offsets_[j][k];
      for (std::size_t i = 0; i < grid.columns; ++i) {
        const SampleOffsets& offsets = samplePattern()[j * kPatternSize + i % kPatternSize];
        row.x.push_back(offsets.x[k]);
        row.y.push_back(offsets.y[k]);
        row.length.push_back(offsets.length[k]);
      }
    }
  }
}

/// Clamps the offsets so that both neighbours are in the image.
void OcclusionSampler::computeSteps(const PairRow& offsets, float borderDistanceY) {
  constexpr float kAbove = 4096.5f;  // more than any grid's size; makes truncation round
  const int columns = static_cast<int>(grid_.columns);
  const auto rounded = [](float offset, float borderDistance) {
    return static_cast<int>(std::min(std::max(offset, -borderDistance), borderDistance) + kAbove) -
           4096;
  };
  for (std::size_t i = 0; i < step_.size(); ++i) {
    const int x = rounded(offsets.x[i] * radius_[i], borderDistanceX_[i]);
    step_[i] = columns * rounded(offsets.y[i] * radius_[i], borderDistanceY) + x;
  }
}

void OcclusionSampler::sampleRow(std::size_t j, std::span<float> occlusion) {
  const float* depthRow = &grid_.affineDepth[j * grid_.columns];
  const bool parallel = grid_.parallel;
  const float scale = grid_.scale;
  for (std::size_t i = 0; i < occlusion.size(); ++i) {
    radius_[i] = std::clamp(kRadius * scale * (parallel ? 1.0f : depthRow[i]), kMinRadiusPixels / 2,
                            kMaxRadiusPixels / 2);
    occlusion[i] = 0;
  }
  const auto borderDistanceY = static_cast<float>(std::min(j, grid_.rows - 1 - j));
  for (const PairRow& offsets : offsets_[j % kPatternSize]) {
    computeSteps(offsets, borderDistanceY);
    for (std::size_t i = 0; i < occlusion.size(); ++i)
      mean_[i] = 0.5f * (depthRow[static_cast<int>(i) + step_[i]] +
                         depthRow[static_cast<int>(i) - step_[i]]);
    for (std::size_t i = 0; i < occlusion.size(); ++i) {
      const float rise = (mean_[i] - depthRow[i]) / (parallel ? 1.0f : std::max(mean_[i], 1e-30f));
      const float offset = std::max(offsets.length[i] * radius_[i], 1.0f);
      occlusion[i] += computeSlopeOcclusion(rise * scale / offset) / kPairCount;
    }
  }
}

/// Depth-aware average of sample values.
struct BilateralFilter {
  const std::vector<float>& distances;
  bool parallel;
  std::vector<float> values, sums, counts;

  /// For `count` samples from `first` on, adds the values `step` samples away if their distance is
  /// similar.
  void accumulate(std::size_t first, std::size_t count, std::ptrdiff_t step, float share) {
    const float* distance = &distances[first];
    const float* otherDistance = distance + step;
    const float* otherValue = &values[first] + step;
    float* sum = &sums[first];
    float* totalWeight = &counts[first];
    for (std::size_t i = 0; i < count; ++i) {
      const float within = computeDepthTolerance(distance[i], parallel);
      const float weight = std::abs(otherDistance[i] - distance[i]) <= within ? share : 0.0f;
      sum[i] += weight * otherValue[i];
      totalWeight[i] += weight;
    }
  }
  void normalize() {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = sums[i] / counts[i];
    std::fill(sums.begin(), sums.end(), 0.0f);
    std::fill(counts.begin(), counts.end(), 0.0f);
  }
};

/// Separable blur over two samples to both sides, along rows, then along columns. The outer samples
/// have half weight, four in total, which is the size of the pattern.
void applyBilateralBlur(BilateralFilter& filter, std::size_t columns, std::size_t rows) {
  constexpr std::array<float, 5> kShares{0.5f, 1, 1, 1, 0.5f};
  for (std::size_t k = 0; k < kShares.size(); ++k) {
    const std::size_t before = k < 2 ? 2 - k : 0, after = k > 2 ? k - 2 : 0;
    if (before + after >= columns) continue;
    for (std::size_t j = 0; j < rows; ++j)
      filter.accumulate(j * columns + before, columns - before - after,
                        static_cast<std::ptrdiff_t>(k) - 2, kShares[k]);
  }
  filter.normalize();
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t k = 0; k < kShares.size(); ++k) {
      if (j + k < 2 || j + k >= rows + 2) continue;
      filter.accumulate(j * columns, columns,
                        static_cast<std::ptrdiff_t>(columns) * (static_cast<int>(k) - 2),
                        kShares[k]);
    }
  }
  filter.normalize();
}

/// Mean of two values, weighted by the similarity of their distances to `distance`; each weight has
/// a small minimum.
float interpolateByDepth(float distance, float within, float distanceA, float a, float distanceB,
                         float b) {
  const float shareA = 1e-3f + std::max(0.0f, 1 - std::abs(distanceA - distance) / within);
  const float shareB = 1e-3f + std::max(0.0f, 1 - std::abs(distanceB - distance) / within);
  return (shareA * a + shareB * b) / (shareA + shareB);
}

}  // namespace

// Every second pixel is a sample. The basis counts from the middle to the edge.
AmbientOcclusion::AmbientOcclusion(const std::vector<float>& depth, const Camera& camera)
    : AmbientOcclusion(depth, camera,
                       static_cast<float>(computeCameraBasis(camera).scaleY) / 4 *
                           static_cast<float>(camera.height)) {}

AmbientOcclusion::AmbientOcclusion(const std::vector<float>& range, const Camera& camera,
                                   double pixelsPerRadian)
    : AmbientOcclusion(range, camera, static_cast<float>(0.5 * pixelsPerRadian)) {}

AmbientOcclusion::AmbientOcclusion(const std::vector<float>& depth, const Camera& camera,
                                   float scale)
    : depth_(depth),
      width_(static_cast<std::size_t>(camera.width)),
      parallel_(camera.projection == Camera::Projection::orthographic),
      columns_((width_ + 1) / 2) {
  ENFILADE_ASSERT(depth.size() == width_ * static_cast<std::size_t>(camera.height));
  const std::size_t rows = (static_cast<std::size_t>(camera.height) + 1) / 2;
  const std::size_t sampleCount = columns_ * rows;
  distances_.resize(sampleCount);
  for (std::size_t j = 0; j < rows; ++j) {
    const float* row = &depth[2 * j * width_];
    float* distance = &distances_[j * columns_];
    for (std::size_t i = 0; i < columns_; ++i)
      distance[i] = std::isnan(row[2 * i]) ? kNoSurface : row[2 * i];
  }
  SampleGrid grid{columns_, rows, parallel_, scale, {}};
  grid.affineDepth.resize(sampleCount);
  const auto far = static_cast<float>(camera.far);
  for (std::size_t i = 0; i < sampleCount; ++i)
    grid.affineDepth[i] = parallel_ ? -std::min(distances_[i], far) : 1 / distances_[i];
  BilateralFilter filter{distances_, parallel_, std::vector<float>(sampleCount),
                         std::vector<float>(sampleCount), std::vector<float>(sampleCount)};
  OcclusionSampler sampler(grid);
  for (std::size_t j = 0; j < rows; ++j)
    sampler.sampleRow(j, std::span(filter.values).subspan(j * columns_, columns_));
  for (std::size_t i = 0; i < sampleCount; ++i)
    filter.values[i] = distances_[i] < kNoSurface ? filter.values[i] : 0.0f;
  applyBilateralBlur(filter, columns_, rows);
  occlusion_ = std::move(filter.values);
  for (float& value : occlusion_) value *= 255 * kStrength;
}

void AmbientOcclusion::computeRow(int y, std::span<std::uint8_t> visibility) const {
  const auto row = static_cast<std::size_t>(y);
  ENFILADE_ASSERT(row < depth_.size() / width_ && visibility.size() == width_);
  // The samples of the row; in an odd row, they are interpolated from the rows above and below.
  // Then the pixels between them, one after each sample.
  const std::size_t count = width_ / 2;
  std::vector<float> distances(columns_ + 1), occlusions(columns_ + 1), otherDistances(count),
      otherOcclusions(count);
  const float* depth = &depth_[row * width_];
  const auto distanceAt = [&](std::size_t x) {
    return std::isnan(depth[x]) ? kNoSurface : depth[x];
  };
  for (std::size_t i = 0; i < columns_; ++i) distances[i] = distanceAt(2 * i);
  for (std::size_t i = 0; i < count; ++i) otherDistances[i] = distanceAt(2 * i + 1);
  const std::size_t above = row / 2 * columns_;
  const std::size_t last = distances_.size() - columns_;
  const std::size_t below = std::min((row + 1) / 2 * columns_, last);
  for (std::size_t i = 0; i < columns_; ++i) {
    occlusions[i] = interpolateByDepth(distances[i], computeDepthTolerance(distances[i], parallel_),
                                       distances_[above + i], occlusion_[above + i],
                                       distances_[below + i], occlusion_[below + i]);
  }
  distances[columns_] = kNoSurface;
  occlusions[columns_] = 0;
  for (std::size_t i = 0; i < count; ++i) {
    otherOcclusions[i] =
        interpolateByDepth(otherDistances[i], computeDepthTolerance(otherDistances[i], parallel_),
                           distances[i], occlusions[i], distances[i + 1], occlusions[i + 1]);
  }
  const auto byte = [](float occlusion) {
    return static_cast<std::uint8_t>(static_cast<int>(255.5f - occlusion));
  };
  for (std::size_t i = 0; i < count; ++i) {
    visibility[2 * i] = byte(occlusions[i]);
    visibility[2 * i + 1] = byte(otherOcclusions[i]);
  }
  if (count < columns_) visibility[2 * count] = byte(occlusions[count]);
}

}  // namespace enfilade::render
