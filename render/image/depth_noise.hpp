// Noise of a structured-light depth camera.
#pragma once

#include <cstdint>
#include <vector>

namespace enfilade::render {

struct DepthNoise {
  std::uint64_t seed = 0;
  double scale = 1;  ///< of the random parts
};

/// Replaces depths in metres (NaN: none) by those of a structured-light camera: the model of Choi,
/// Choi et al. 2015 ("Robust Reconstruction of Indoor Scenes") without their table of one
/// device's distortion. Each pixel takes the depth of a neighbour, and its disparity gets noise and
/// is rounded to an eighth; depths from 10 m on are lost. The result depends on seed, `frame` and
/// pixel alone.
void addDepthNoise(std::vector<float>& depth, int width, int height, const DepthNoise& noise,
                   std::uint64_t frame);

}  // namespace enfilade::render
