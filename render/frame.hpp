// A picture: colour, object ids, depth and normals of one tick, from one pass.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "render/camera.hpp"

namespace enfilade::render {

/// What is wanted of a picture. What is not costs nothing, and its vector stays empty.
struct Channels {
  bool rgb = true, ids = true, depth = true, normals = false;
};

/// What BLEND materials do: colour what lies behind them and let ids, depth and normals through, or
/// hide it as if they were opaque.
enum class Glass : std::uint8_t { clear, solid };

struct FrameOptions {
  scene::EntityId hidden = 0;  ///< not drawn (the avatar whose eyes these are); 0: all is drawn
  Channels channels = {};
  Glass glass = Glass::clear;
};

/// Row 0 is the top row; pixel (x, y) is at index y * width + x.
struct Frame {
  Camera camera;
  std::uint64_t tick = 0;
  std::string renderer;            ///< the device that made it (GL_RENDERER), or "Embree ..."
  bool software = false;           ///< made by a CPU
  std::vector<std::uint8_t> rgb;   ///< sRGB, 3 bytes a pixel
  std::vector<std::uint32_t> ids;  ///< scene::EntityId of what is seen; 0: nothing
  std::vector<float> depth;        ///< z-distance along `forward` in metres; NaN: nothing
  /// 3 floats a pixel, unit length, world frame, facing the eye; 0, 0, 0 where nothing is.
  std::vector<float> normals;
};

/// The frame's depth as the distance along each pixel's ray in metres: from the eye in a
/// perspective, from the plane of the eye (where it is z) in an orthographic picture. NaN stays
/// NaN.
std::vector<float> rangeOf(const Frame& frame);

}  // namespace enfilade::render
