// The interface of the renderers, implemented by GlRenderer and RayRenderer.
#pragma once

#include <string>

#include "render/frame.hpp"
#include "render/render_error.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::render {

/// Renders snapshots of one scene. Create, use and destroy it on one thread.
class Renderer {
 public:
  Renderer() = default;
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  virtual ~Renderer() = default;

  /// Throws RenderError for an invalid camera (validateCamera()) or number of samples, and for a
  /// scene that is too large.
  Frame render(const scene::Snapshot& snapshot, const Camera& camera,
               const FrameOptions& options = {});

  virtual const std::string& deviceName() const = 0;  ///< GL_RENDERER or "Embree 3..."
  virtual bool software() const = 0;                  ///< renders on the CPU
  /// One sentence about better devices that failed; may be empty.
  virtual const std::string& deviceWarning() const = 0;

 private:
  /// One sample a pixel, whatever `options` has. The camera is valid, except that its principal
  /// point may be up to a pixel beyond its limits.
  virtual Frame renderOnce(const scene::Snapshot& snapshot, const Camera& camera,
                           const FrameOptions& options) = 0;
  Frame renderSamples(const scene::Snapshot& snapshot, const Camera& camera,
                      const FrameOptions& options);
};

}  // namespace enfilade::render
