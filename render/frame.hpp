// A rendered frame: colour, object ids, depth and normals of one tick.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "render/camera/camera.hpp"

namespace enfilade::render {

/// The requested channels. Other channels cost nothing, and their vectors stay empty.
struct Channels {
  bool rgb = true, ids = true, depth = true, normals = false;

  bool isDepthOnly() const { return !rgb && !ids && !normals; }
};

/// Treatment of BLEND materials. `blend`: they tint the colour behind them and do not affect ids,
/// depth and normals. `opaque`: they are drawn as opaque surfaces.
enum class TransparencyMode : std::uint8_t { blend, opaque };

/// Culling of draw items. The frame is the same in all three modes, byte for byte.
enum class Culling : std::uint8_t {
  occlusion,  ///< frustum and occlusion culling
  frustum,    ///< frustum culling
  none  ///< frustum culling with one draw call per item: the reference for tests and benchmarks
};

/// Drawn shape of avatars, in all channels and shadows. `figure`: a person, if isPerson(); other
/// avatars are drawn as with `collision`. `collision`: the convex parts that the world moves, with
/// a wedge at the eyes.
enum class AvatarForm : std::uint8_t { figure, collision };

/// Options of one frame.
struct FrameOptions {
  scene::EntityId hiddenEntity = 0;  ///< not drawn (the avatar whose camera this is); 0: none
  Channels channels = {};
  TransparencyMode transparency = TransparencyMode::blend;
  AvatarForm avatars = AvatarForm::figure;
  Culling culling = Culling::occlusion;
  /// Whether surfaces cast sun shadows. Transparent surfaces in mode `blend` and geometry clipped
  /// by an orthographic camera cast none; transparent surfaces receive none.
  bool shadows = false;
  /// RendererSelector decides `shadows`, by choosesShadows().
  bool automaticShadows = false;
  /// Samples of the colour in each pixel: 1, 4 or 16. Each of them is a picture of its own, and the
  /// colour their mean in linear light. The other channels have one sample, at the centre.
  std::uint32_t samples = 1;
};

/// A frame to render.
struct View {
  const scene::Snapshot* snapshot = nullptr;  ///< required
  Camera camera;
  FrameOptions options;
};

/// Culling counts of draw items (meshes of objects) and rendering time.
struct FrameStatistics {
  std::uint32_t drawn = 0;
  std::uint32_t frustumCulled = 0;  ///< outside the frustum
  std::uint32_t occluded = 0;       ///< in the frustum, but hidden by drawn surfaces
  std::uint32_t passes = 1;         ///< number of draw passes, including those for culling
  /// Wall-clock time until the pixels were read back; of views rendered together, an equal share.
  double seconds = 0;
};

/// Row 0 is the top row; pixel (x, y) is at index y * width + x.
struct Frame {
  Camera camera;
  std::uint64_t tick = 0;
  AvatarForm avatars = AvatarForm::figure;  ///< as drawn
  bool shadows = false;                     ///< in the colour
  std::uint32_t samples = 1;                ///< of the colour in each pixel
  std::string renderer;                     ///< the device (GL_RENDERER), or "Embree ..."
  bool software = false;                    ///< rendered on the CPU
  FrameStatistics statistics;
  std::vector<std::uint8_t> rgb;   ///< sRGB, 3 bytes per pixel
  std::vector<std::uint32_t> ids;  ///< scene::EntityId of the visible surface; 0: background
  std::vector<float> depth;        ///< z-distance along `forward` in metres; NaN: background
  std::vector<float> range;        ///< with a lens: distance along the ray in metres; else empty
  /// 3 floats per pixel, unit length, world frame, on the side of the surface that faces the eye;
  /// background: 0, 0, 0.
  std::vector<float> normals;
};

/// The frame's depth as the distance along each pixel's ray in metres. Perspective: from the eye;
/// orthographic: from the eye's plane, which equals the depth. NaN stays NaN.
std::vector<float> computeRange(const Frame& frame);

}  // namespace enfilade::render
