#include "render/image/depth_noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace enfilade::render {
namespace {

constexpr double kPixelDeviation = 0.25;          // pixels, of the neighbour
constexpr double kDisparityDeviation = 1.0 / 36;  // pixels
constexpr double kDisparitySteps = 8;             // per pixel
constexpr double kDisparityAtOneMetre = 35.13;    // pixels: focal length times base
constexpr double kMaxDepth = 10;                  // metres

/// SplitMix64 (Steele, Lea, Flood 2014): a bijection that mixes all bits.
std::uint64_t mix(std::uint64_t value) {
  value += 0x9E37'79B9'7F4A'7C15u;
  value = (value ^ (value >> 30)) * 0xBF58'476D'1CE4'E5B9u;
  value = (value ^ (value >> 27)) * 0x94D0'49BB'1331'11EBu;
  return value ^ (value >> 31);
}

/// Independent numbers of a pixel: a generator whose state is a counter.
class PixelRandom {
 public:
  explicit PixelRandom(std::uint64_t key) : key_(key) {}
  /// Of the normal distribution (Box and Muller 1958).
  double normal() {
    const double u = 1 - uniform(), v = uniform();
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
  }

 private:
  double uniform() { return static_cast<double>(mix(key_ + ++count_) >> 11) * 0x1p-53; }
  std::uint64_t key_, count_ = 0;
};

/// The device's distortion at a pixel.
class Distortion {
 public:
  Distortion(const DepthNoise& noise, int width, int height)
      : table_(noise.distortion), width_(width), height_(height), rows_(noise.distortionRows) {
    if (rows_ > 0) columns_ = static_cast<int>(table_.size()) / (rows_ * kDistortionDepths);
  }
  /// The depth that the device takes for a true one; 0: none.
  double at(int x, int y, double depth) const {
    if (columns_ == 0) return depth;
    const auto cell =
        static_cast<std::size_t>(y * rows_ / height_ * columns_ + x * columns_ / width_);
    const float* factors = &table_[cell * kDistortionDepths];
    const double knot = std::clamp(0.5 * (depth - 1), 0.0, kDistortionDepths - 1.0);
    const int below = std::min(static_cast<int>(knot), kDistortionDepths - 2);
    const double part = knot - below;
    const double factor = (1 - part) * static_cast<double>(factors[below]) +
                          part * static_cast<double>(factors[below + 1]);
    return factor < kMinFactor ? 0 : depth / factor;
  }

 private:
  static constexpr double kMinFactor = 1e-5;
  const std::vector<float>& table_;
  int width_, height_, rows_, columns_ = 0;
};

/// The depth that the camera reports for a true one.
double measure(double seen, int x, int y, const Distortion& distortion, double noise) {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  if (!(seen > 0 && seen < kMaxDepth)) return kNothing;
  const double depth = distortion.at(x, y, seen);
  if (!(depth > 0)) return kNothing;
  const double steps = std::floor(
      (kDisparityAtOneMetre / depth + noise * kDisparityDeviation) * kDisparitySteps + 0.5);
  return steps > 0 ? kDisparityAtOneMetre * kDisparitySteps / steps : kNothing;
}

}  // namespace

void addDepthNoise(std::vector<float>& depth, int width, int height, const DepthNoise& noise,
                   std::uint64_t frame) {
  const std::vector<float> clean = depth;
  const Distortion distortion(noise, width, height);
  const std::uint64_t key = mix(mix(noise.seed) ^ frame);
  const auto neighbour = [&](int at, double shift, int end) {
    return std::clamp(static_cast<int>(std::floor(at + shift + 0.5)), 0, end - 1);
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                         static_cast<std::size_t>(x);
      PixelRandom random(mix(key ^ pixel));
      const double deviation = noise.scale * kPixelDeviation;
      const int row = neighbour(y, deviation * random.normal(), height);
      const int column = neighbour(x, deviation * random.normal(), width);
      const float seen = clean[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                               static_cast<std::size_t>(column)];
      depth[pixel] = static_cast<float>(measure(static_cast<double>(seen), column, row, distortion,
                                                noise.scale * random.normal()));
    }
}

}  // namespace enfilade::render
