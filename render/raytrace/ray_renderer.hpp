// Renders snapshots of one scene by ray tracing on the CPU: the same cameras, channels and ids as
// GlRenderer, with depth computed in doubles. The time depends little on the scene's size.
#pragma once

#include <memory>

#include "render/renderer.hpp"

namespace enfilade::render {

/// Options of a RayRenderer.
struct RayOptions {
  int threads = 2;  ///< 1..64; frames do not depend on it
};

/// Depth is exact for the ray through the pixel's centre. Transparent surfaces are sorted per
/// pixel, not per object. Textures are filtered by GL's standard, from which devices deviate
/// slightly.
class RayRenderer final : public Renderer {
 public:
  /// Throws RenderError if Embree is unavailable. Trees are built with the first frame that needs
  /// them.
  explicit RayRenderer(std::shared_ptr<const scene::Scene> scene, const RayOptions& options = {});
  ~RayRenderer() override;

  const std::string& deviceName() const override;
  bool software() const override { return true; }
  const std::string& deviceWarning() const override;  ///< empty

  /// Shadow mask of a frame with this camera: 255 per sunlit pixel, 0 in shadow (see
  /// FrameOptions::shadows). `depth` is the Frame::depth of any renderer, which accepted the
  /// camera.
  std::vector<std::uint8_t> computeShadowMask(const scene::Snapshot& snapshot, const Camera& camera,
                                              const FrameOptions& options,
                                              const std::vector<float>& depth);

 private:
  std::vector<Frame> renderOnce(std::span<const View> views) override;

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
