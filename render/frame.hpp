// A picture: colour, object ids, depth and normals of one tick.
#pragma once

#include <cstdint>
#include <functional>
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

/// What is left out of the drawing. The picture is the same in all three, byte for byte.
enum class Culling : std::uint8_t {
  hidden,   ///< what lies beside the picture or behind what is drawn
  outside,  ///< what lies beside the picture
  singly    ///< as outside, and one draw an object: the slow twin of tests and benchmarks
};

struct FrameOptions {
  scene::EntityId hidden = 0;  ///< not drawn (the avatar whose eyes these are); 0: all is drawn
  Channels channels = {};
  Glass glass = Glass::clear;
  Culling culling = Culling::hidden;
  /// Whether things keep the sun from one another. They are cast by what the picture shows, not by
  /// clear glass, nor by what an orthographic camera cuts away; glass itself stands in the sun.
  bool shadows = false;
};

/// Which pixels of a picture the sun may reach, by its Frame::depth: 255, or 0 in shadow.
using Sunlit = std::function<std::vector<std::uint8_t>(const std::vector<float>& depth)>;

/// How it was made: meshes of objects, each counted once.
struct FrameStatistics {
  std::uint32_t drawn = 0;
  std::uint32_t outside = 0;   ///< beside the picture
  std::uint32_t occluded = 0;  ///< in the picture, behind what was drawn
  std::uint32_t passes = 1;    ///< drawings that it took to find what is seen and to draw it
  double seconds = 0;          ///< of wall-clock time, until its pixels were read back
};

/// Row 0 is the top row; pixel (x, y) is at index y * width + x.
struct Frame {
  Camera camera;
  std::uint64_t tick = 0;
  std::string renderer;   ///< the device that made it (GL_RENDERER), or "Embree ..."
  bool software = false;  ///< made by a CPU
  FrameStatistics statistics;
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
