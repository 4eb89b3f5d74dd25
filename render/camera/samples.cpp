#include "render/camera/samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/assert.hpp"
#include "render/camera/camera.hpp"
#include "scene/model/srgb.hpp"

namespace enfilade::render {
namespace {

constexpr std::uint32_t kFullLight = 65535;  // of linear light

/// The standard patterns of Direct3D 11 for 4 and 16 samples, in sixteenths of a pixel. No two
/// samples share a row or a column, so that edges near the axes have as many steps as samples. The
/// second pattern is moved by half a step to be centred.
std::vector<Eigen::Vector2d> makePattern(int samples) {
  constexpr std::array<std::array<double, 2>, 4> kFour{{{-2, -6}, {6, -2}, {-6, 2}, {2, 6}}};
  constexpr std::array<std::array<double, 2>, 16> kSixteen{{{1, 1},
                                                            {-1, -3},
                                                            {-3, 2},
                                                            {4, -1},
                                                            {-5, -2},
                                                            {2, 5},
                                                            {5, 3},
                                                            {3, -5},
                                                            {-2, 6},
                                                            {0, -7},
                                                            {-4, -6},
                                                            {-6, 4},
                                                            {-8, 0},
                                                            {7, -4},
                                                            {6, 7},
                                                            {-7, -8}}};
  std::vector<Eigen::Vector2d> positions;
  if (samples == 4)
    for (const auto& [x, y] : kFour) positions.emplace_back(x / 16, y / 16);
  else
    for (const auto& [x, y] : kSixteen) positions.emplace_back((x + 0.5) / 16, (y + 0.5) / 16);
  return positions;
}

using LinearTable = std::array<std::uint32_t, 256>;

/// Linear light of sRGB bytes, 0..kFullLight.
const LinearTable& getDecodingTable() {
  static const LinearTable table = [] {
    LinearTable values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const float linear = scene::srgbToLinear(static_cast<float>(i) / 255);
      values[i] = static_cast<std::uint32_t>(std::lround(kFullLight * static_cast<double>(linear)));
    }
    return values;
  }();
  return table;
}

/// The inverse: for each linear value, the byte whose linear light is nearest.
const std::vector<std::uint8_t>& getEncodingTable() {
  static const std::vector<std::uint8_t> table = [] {
    const LinearTable& linear = getDecodingTable();
    std::vector<std::uint8_t> bytes;
    for (std::uint32_t value = 0; value <= kFullLight; ++value) {
      const std::size_t previous = bytes.empty() ? 0 : bytes.back();
      const bool nearer = previous < 255 && linear[previous + 1] + linear[previous] < 2 * value + 1;
      bytes.push_back(static_cast<std::uint8_t>(previous + (nearer ? 1 : 0)));
    }
    return bytes;
  }();
  return table;
}

}  // namespace

bool isSampleCount(std::uint64_t samples) {
  return samples == 1 || samples == 4 || samples == 16;
}

std::span<const Eigen::Vector2d> getSamplePositions(int samples) {
  ENFILADE_ASSERT(samples == 4 || samples == 16);
  static const std::vector<Eigen::Vector2d> four = makePattern(4), sixteen = makePattern(16);
  return samples == 4 ? four : sixteen;
}

Camera shiftCamera(const Camera& camera, const Eigen::Vector2d& offset) {
  Camera shifted = camera;
  if (camera.lens) {
    shifted.lens->offsetX += offset.x();
    shifted.lens->offsetY += offset.y();
  } else if (camera.projection == Camera::Projection::perspective) {
    shifted.pinhole = computeIntrinsics(camera);
    shifted.pinhole->cx -= offset.x();
    shifted.pinhole->cy -= offset.y();
  } else {
    const CameraBasis basis = computeCameraBasis(camera);
    const double metresPerPixel = camera.heightY / camera.height;
    shifted.eye += metresPerPixel * (offset.x() * basis.right - offset.y() * basis.up);
  }
  return shifted;
}

void MeanColour::add(const std::vector<std::uint8_t>& srgb) {
  ENFILADE_ASSERT(srgb.size() == sums_.size());
  const LinearTable& linear = getDecodingTable();
  for (std::size_t i = 0; i < srgb.size(); ++i) sums_[i] += linear[srgb[i]];
  ++pictures_;
}

std::vector<std::uint8_t> MeanColour::compute() const {
  ENFILADE_ASSERT(pictures_ > 0);
  const std::vector<std::uint8_t>& srgb = getEncodingTable();
  std::vector<std::uint8_t> mean(sums_.size());
  std::ranges::transform(sums_, mean.begin(), [&](std::uint32_t sum) {
    return srgb[(sum + pictures_ / 2) / pictures_];
  });
  return mean;
}

}  // namespace enfilade::render
