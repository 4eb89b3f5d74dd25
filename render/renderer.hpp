// The interface of the renderers, implemented by GlRenderer and RayRenderer.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "render/frame.hpp"
#include "render/render_error.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::render {

/// Views with up to this many pixels in total take less time together; more need more memory.
inline constexpr std::size_t kMaxPixelsTogether = std::size_t{1} << 21;

/// Renders snapshots of one scene, also of several of its worlds. Create, use and destroy it on one
/// thread.
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
  /// As above, of several views, of one snapshot or of several. The frames are the same, and they
  /// take less time together.
  std::vector<Frame> render(std::span<const View> views);

  virtual const std::string& deviceName() const = 0;  ///< GL_RENDERER or "Embree 3..."
  virtual bool software() const = 0;                  ///< renders on the CPU
  /// One sentence about better devices that failed; may be empty.
  virtual const std::string& deviceWarning() const = 0;

 private:
  /// One sample a pixel, whatever the options have. The cameras are valid, except that a principal
  /// point may be up to a pixel beyond its limits.
  virtual std::vector<Frame> renderOnce(std::span<const View> views) = 0;
  Frame renderSamples(const View& view);
};

}  // namespace enfilade::render
