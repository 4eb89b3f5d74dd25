// Draws draw lists and the sky: programs, uniforms and stream buffers.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "render/draw_list.hpp"
#include "render/gl/gl_objects.hpp"
#include "render/vertex.hpp"

namespace enfilade::render {

/// A buffer for data that changes per draw; it only grows.
class StreamBuffer {
 public:
  void fill(const void* data, std::size_t bytes);
  unsigned name() const { return buffer_.name(); }

 private:
  GlBuffer buffer_;
  std::size_t capacity_ = 0;
};

/// The buffers and textures of a draw list.
struct Geometry {
  unsigned vertices, indices;              ///< buffer names
  unsigned colours;                        ///< buffer name; 0: no mesh has vertex colours
  const std::vector<GlTexture>& textures;  ///< indexed by Batch::texture
};

/// Programs and state of all passes. Needs a current context, always the same.
class SurfacePass {
 public:
  /// `roundsVertices`: see DeviceChoice. `hasPlaneDepth`: the depth of frames is that of planes, so
  /// offsets in the depth buffer do not change it.
  SurfacePass(bool roundsVertices, bool hasPlaneDepth);

  /// Sets the common state and the camera.
  void begin(const Camera& camera);
  /// The following draws write only depth and id; at equal depth, the last draw wins. In all
  /// passes, `planeDepth` also writes RenderTarget's plane depth.
  void beginDepthPrepass(bool planeDepth);
  /// The following draws shade pixels of equal depth. `shadows`: uses
  /// RenderTarget::setShadowMask().
  void beginEqualDepthPass(bool normals, bool shadows, bool planeDepth);
  /// The following draws write depth and shade; at equal depth, the last draw wins.
  void beginForwardPass(bool normals, bool planeDepth);
  void draw(const DrawList& list, const Geometry& geometry);
  void drawSky() const;
  /// The following draws blend over the colour; its alpha channel accumulates the transmittance.
  void beginTransparentPass();

 private:
  unsigned findProgram(const Batch& batch);
  void enableColours(bool coloured);
  void setCoplanarRank(std::uint8_t rank);

  bool roundsVertices_;
  float coplanarSlope_;
  std::uint8_t coplanarRank_ = 0;  ///< of the current draws
  GlVertexArray vertexArray_;
  GlBuffer uniforms_;
  GlProgram sky_;
  std::array<std::optional<GlProgram>, 512> surfaces_;  ///< see findProgram()
  bool shaded_ = true, normals_ = false, plan_ = false, shadows_ = false, planeDepth_ = false;
  bool coloured_ = false;  ///< the attribute is enabled
  StreamBuffer instances_, commands_;
};

}  // namespace enfilade::render
