// Draws snapshots of one scene with OpenGL 4.5 core on EGL, without a display.
#pragma once

#include <memory>

#include "render/device.hpp"
#include "render/frame.hpp"
#include "render/render_error.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::render {

/// Owns a GL context: make, use and destroy it on one thread. RenderThread does that for you.
class GlRenderer {
 public:
  /// Throws RenderError when no device that is chosen gives a context. The scene is brought to the
  /// device with the first picture.
  explicit GlRenderer(std::shared_ptr<const scene::Scene> scene, const DeviceChoice& device = {});
  ~GlRenderer();
  GlRenderer(const GlRenderer&) = delete;
  GlRenderer& operator=(const GlRenderer&) = delete;

  /// Throws RenderError for a camera that refusal() refuses, and for a scene too large to draw.
  /// `sunlit` is asked where options.shadows wants shadows in a colour; it may not be empty then.
  Frame render(const scene::Snapshot& snapshot, const Camera& camera,
               const FrameOptions& options = {}, const Sunlit& sunlit = {});

  const std::string& deviceName() const;  ///< GL_RENDERER
  bool software() const;
  /// Which better devices were tried in vain, one sentence; empty when none was.
  const std::string& deviceNote() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
