// Draws lists of surfaces and the sky: programs, uniforms, streams.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "render/draw_list.hpp"
#include "render/gl/gl_objects.hpp"
#include "render/vertex.hpp"

namespace enfilade::render {

/// A buffer that is filled anew again and again; it only grows.
class StreamBuffer {
 public:
  void fill(const void* data, std::size_t bytes);
  unsigned name() const { return buffer_.name(); }

 private:
  GlBuffer buffer_;
  std::size_t room_ = 0;
};

/// Where a list's vertices come from.
struct Geometry {
  unsigned vertices, indices;              ///< names of buffers
  const std::vector<GlTexture>& textures;  ///< by Batch::texture
};

/// Needs a current context, always the same.
class SurfacePass {
 public:
  SurfacePass();

  /// The state that all drawing shares, and the camera.
  void begin(const Camera& camera);
  /// What is drawn after it has only a depth and an id, of several equally near ones the last.
  void toDepth();
  /// What is drawn after it is shaded where it is as near as the depth that is there.
  /// With shadows, in the light of FrameTarget::lightBy().
  void shadeNearest(bool normals, bool shadows);
  /// Both at once: what is drawn after it is shaded where nothing nearer was drawn before.
  void shadeAll(bool normals);
  void draw(const DrawList& list, const Geometry& geometry);
  void drawSky() const;
  /// What is drawn after it lies over the colour, whose alpha is left with what shines through.
  void blendGlass();

 private:
  unsigned program(const Batch& batch);

  GlVertexArray vertexArray_;
  GlBuffer uniforms_;
  GlProgram sky_;
  std::array<std::optional<GlProgram>, 128> surfaces_;  ///< see program()
  bool shaded_ = true, normals_ = false, plan_ = false, shadows_ = false;
  StreamBuffer instances_, commands_;
};

}  // namespace enfilade::render
