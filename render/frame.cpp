#include "render/frame.hpp"

#include <cmath>

namespace enfilade::render {

std::vector<float> computeRange(const Frame& frame) {
  if (frame.camera.lens) return frame.range;
  std::vector<float> range = frame.depth;
  if (frame.camera.projection == Camera::Projection::orthographic) return range;
  const Pinhole pinhole = computeIntrinsics(frame.camera);
  std::size_t pixel = 0;
  for (int y = 0; y < frame.camera.height && pixel < range.size(); ++y) {
    const double v = (y + 0.5 - pinhole.cy) / pinhole.fy;
    for (int x = 0; x < frame.camera.width; ++x, ++pixel) {
      const double u = (x + 0.5 - pinhole.cx) / pinhole.fx;
      range[pixel] = static_cast<float>(range[pixel] * std::sqrt(1 + u * u + v * v));
    }
  }
  return range;
}

}  // namespace enfilade::render
