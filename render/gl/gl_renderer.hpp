// Draws snapshots of one scene with OpenGL 4.5 core on EGL, without a display.
#pragma once

#include <memory>

#include "render/frame.hpp"
#include "render/render_error.hpp"
#include "scene/scene.hpp"

namespace enfilade::render {

/// Owns a GL context: make, use and destroy it on one thread. RenderThread does that for you.
class GlRenderer {
 public:
  /// Throws RenderError when no EGL device gives a context. The scene is brought to the device with
  /// the first picture.
  explicit GlRenderer(std::shared_ptr<const scene::Scene> scene);
  ~GlRenderer();
  GlRenderer(const GlRenderer&) = delete;
  GlRenderer& operator=(const GlRenderer&) = delete;

  /// `hidden` is not drawn (the avatar whose eyes these are); 0: everything is drawn.
  /// Throws RenderError for a camera that refusal() refuses, and for a scene too large to draw.
  Frame render(const scene::Snapshot& snapshot, const Camera& camera, scene::EntityId hidden = 0);

  const std::string& deviceName() const;  ///< GL_RENDERER
  bool software() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
