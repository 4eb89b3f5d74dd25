// Renders snapshots of one scene with OpenGL 4.5 core on EGL, without a display.
#pragma once

#include <functional>
#include <memory>

#include "render/device.hpp"
#include "render/renderer.hpp"

namespace enfilade::render {

/// Computes the shadow mask of a frame from its Frame::depth: 255 per sunlit pixel, 0 in shadow.
using ShadowMaskFunction = std::function<std::vector<std::uint8_t>(
    const scene::Snapshot& snapshot, const Camera& camera, const FrameOptions& options,
    const std::vector<float>& depth)>;

/// Owns a GL context.
class GlRenderer final : public Renderer {
 public:
  /// Throws RenderError if no chosen device provides a context. The scene is uploaded with the
  /// first frame. Without `shadowMask`, render() throws for colour with shadows.
  explicit GlRenderer(std::shared_ptr<const scene::Scene> scene, const DeviceChoice& device = {},
                      ShadowMaskFunction shadowMask = {});
  ~GlRenderer() override;

  const std::string& deviceName() const override;
  bool software() const override;
  const std::string& deviceWarning() const override;

 private:
  std::vector<Frame> renderOnce(std::span<const View> views) override;

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
