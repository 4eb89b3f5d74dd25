// A picture: colour, object ids and depth of one tick, from one pass.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "render/camera.hpp"

namespace enfilade::render {

/// Row 0 is the top row; pixel (x, y) is at index y * width + x.
struct Frame {
  Camera camera;
  std::uint64_t tick = 0;
  std::string renderer;            ///< GL_RENDERER of the device that made it
  bool software = false;           ///< made by a CPU
  std::vector<std::uint8_t> rgb;   ///< sRGB, 3 bytes a pixel
  std::vector<std::uint32_t> ids;  ///< scene::EntityId of what is seen; 0: nothing
  std::vector<float> depth;        ///< z-distance along `forward` in metres; NaN: nothing
};

}  // namespace enfilade::render
