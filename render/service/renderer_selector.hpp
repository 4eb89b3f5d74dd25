// Owns the renderers of a scene and selects one for each frame.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "render/device.hpp"
#include "render/renderer.hpp"
#include "render/renderer_kind.hpp"

namespace enfilade::render {

/// Owns a GlRenderer, a RayRenderer or both, each created on first use. Create, use and destroy it
/// on one thread, as RenderThread does.
class RendererSelector {
 public:
  /// If no device provides a context: throws RenderError if `kind` is gl or a GPU is required.
  /// `automatic` then uses only rays, and deviceWarning() states the reason.
  explicit RendererSelector(std::shared_ptr<const scene::Scene> scene,
                            RendererKind kind = RendererKind::automatic,
                            const DeviceChoice& device = {});
  ~RendererSelector();
  RendererSelector(const RendererSelector&) = delete;
  RendererSelector& operator=(const RendererSelector&) = delete;

  /// `kind` other than automatic overrides the constructor's. Throws RenderError like both
  /// renderers, and for rays if a GPU is required.
  Frame render(const scene::Snapshot& snapshot, const Camera& camera,
               const FrameOptions& options = {}, RendererKind kind = RendererKind::automatic);
  /// As above, of several views, which take less time together.
  std::vector<Frame> render(std::span<const RenderRequest> requests);

  /// Frame::renderer of such a frame.
  const std::string& deviceNameFor(const Camera& camera, const FrameOptions& options);

  // As in Renderer, of the default renderer.
  const std::string& deviceName() const;
  bool software() const;
  const std::string& deviceWarning() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
