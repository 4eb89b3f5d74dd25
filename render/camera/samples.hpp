// Supersampling: sample positions in a pixel, and the mean colour of the samples.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "render/camera/camera.hpp"

namespace enfilade::render {

/// The text "1, 4 or 16".
inline constexpr const char* kSampleCounts = "1, 4 or 16";
bool isSampleCount(std::uint64_t samples);

/// Positions in a pixel from its centre, pixels to the right and down. `samples`: 4 or 16.
std::span<const Eigen::Vector2d> getSamplePositions(int samples);

/// The camera that has its pixel centres where `camera` has the points `offset` pixels to the right
/// and down of them. It may have a principal point beyond the limits of validateCamera().
Camera shiftCamera(const Camera& camera, const Eigen::Vector2d& offset);

/// The mean of several pictures in linear light. Equal bytes give the same byte.
class MeanColour {
 public:
  explicit MeanColour(std::size_t bytes) : sums_(bytes) {}
  /// `srgb` has the number of bytes of the constructor.
  void add(const std::vector<std::uint8_t>& srgb);
  std::vector<std::uint8_t> compute() const;  ///< sRGB; after one to 16 pictures

 private:
  std::vector<std::uint32_t> sums_;
  std::uint32_t pictures_ = 0;
};

}  // namespace enfilade::render
