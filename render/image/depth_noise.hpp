// Noise of a structured-light depth camera.
#pragma once

#include <cstdint>
#include <vector>

namespace enfilade::render {

/// Depths of a distortion table: 1, 3, 5, 7 and 9 m.
inline constexpr int kDistortionDepths = 5;

struct DepthNoise {
  std::uint64_t seed = 0;
  double scale = 1;  ///< of the random parts
  /// Factors of one device's depths: for each cell of a grid over the picture, row by row, those at
  /// kDistortionDepths depths. 0: the device sees nothing. Empty: none.
  std::vector<float> distortion = {};
  int distortionRows = 0;
};

/// Replaces depths in metres (NaN: none) by those of a structured-light camera: the model of Choi
/// et al. 2015 ("Robust Reconstruction of Indoor Scenes"). Each pixel takes the depth of a
/// neighbour, which the distortion divides. Its disparity gets noise and is rounded to an eighth.
/// Depths from 10 m on are lost. The result depends on noise, `frame` and pixel alone.
void addDepthNoise(std::vector<float>& depth, int width, int height, const DepthNoise& noise,
                   std::uint64_t frame);

}  // namespace enfilade::render
