// Screen-space ambient occlusion from the depth buffer.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/camera/camera.hpp"

namespace enfilade::render {

/// Ambient occlusion of one frame. Uses only its depth, so that both renderers shade equally.
class AmbientOcclusion {
 public:
  /// `depth` is Frame::depth of a frame of `camera`; kept by reference.
  AmbientOcclusion(const std::vector<float>& depth, const Camera& camera);

  /// Of a picture through a lens: `range` is Frame::range, `pixelsPerRadian` that of the lens. A
  /// plane is nearly affine within the radius around a sample.
  AmbientOcclusion(const std::vector<float>& range, const Camera& camera, double pixelsPerRadian);

  /// Writes the visibility of each pixel of row `y`: 255 means unoccluded. Thread-safe.
  void computeRow(int y, std::span<std::uint8_t> visibility) const;

 private:
  /// `scale`: samples of the grid per unit of the direction's tangent, or per metre.
  AmbientOcclusion(const std::vector<float>& depth, const Camera& camera, float scale);

  const std::vector<float>& depth_;
  std::size_t width_;
  bool parallel_;
  std::size_t columns_;           ///< of the sample grid
  std::vector<float> distances_;  ///< z-distance of each sample, metres; very large without surface
  std::vector<float> occlusion_;  ///< occlusion of each sample, subtracted from 255
};

/// Applies ambient occlusion to sRGB bytes. `visibility`: see computeRow(). `transmittance`: of the
/// transparent surfaces before the pixel; 255: none covers it, 0: the occlusion is invisible.
inline void applyAo(const std::uint8_t* from, std::uint8_t visibility, std::uint8_t transmittance,
                    std::uint8_t* to) {
  constexpr unsigned kAll = 255 * 255;
  if (transmittance == 255) {  // common case; rounded division by 255 without a division
    const auto shaded = [visibility](unsigned value) {
      const unsigned product = value * visibility + 128;
      return static_cast<std::uint8_t>((product + (product >> 8)) >> 8);
    };
    const std::uint8_t r = shaded(from[0]), g = shaded(from[1]), b = shaded(from[2]);
    to[0] = r, to[1] = g, to[2] = b;
    return;
  }
  const unsigned retained = kAll - unsigned{transmittance} * (255u - visibility);
  for (int i = 0; i < 3; ++i)
    to[i] = static_cast<std::uint8_t>((from[i] * retained + kAll / 2) / kAll);
}

}  // namespace enfilade::render
