// Draws snapshots of one scene with rays, on processors alone: the same cameras, channels and ids
// as GlRenderer, with a depth that is exact to doubles, in a time that hardly depends on how large
// the scene is.
#pragma once

#include <memory>

#include "render/frame.hpp"
#include "render/render_error.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::render {

struct RayOptions {
  int threads = 2;     ///< 1..64; pictures do not depend on it
  bool robust = true;  ///< false: a fifth faster, and some rays slip through between triangles
};

/// Use it on one thread at a time.
class RayRenderer {
 public:
  /// Throws RenderError when Embree cannot be had. Trees are built with the first picture that
  /// needs them.
  explicit RayRenderer(std::shared_ptr<const scene::Scene> scene, const RayOptions& options = {});
  ~RayRenderer();
  RayRenderer(const RayRenderer&) = delete;
  RayRenderer& operator=(const RayRenderer&) = delete;

  /// What GlRenderer::render gives, but: depth is that of the exact ray through the pixel's centre;
  /// glass is blended from back to front pixel by pixel, not object by object; textures are
  /// filtered by GL's standard, from which devices differ a little. Throws RenderError for a camera
  /// that refusal() refuses, and for a scene too large for Embree.
  Frame render(const scene::Snapshot& snapshot, const Camera& camera,
               const FrameOptions& options = {});

  /// Which pixels the sun reaches in a picture whose depth is given, whoever drew it: 255, or 0 in
  /// shadow (FrameOptions::shadows). `depth` is Frame::depth of a picture with this camera.
  std::vector<std::uint8_t> sunlit(const scene::Snapshot& snapshot, const Camera& camera,
                                   const FrameOptions& options, const std::vector<float>& depth);

  const std::string& deviceName() const;  ///< "Embree 3..."

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
