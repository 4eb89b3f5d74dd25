// Ground truth for frames: visible surface per pixel, in doubles. Embree, with single rays, only
// proposes triangles. All candidates within its rounding error of the first hit are tested by the
// signs of their weights in doubles. If none is hit, the search continues behind them. Takes some
// microseconds per pixel.
#pragma once

#include <memory>
#include <vector>

#include "render/frame.hpp"
#include "render/render_error.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::render {

/// A reference frame; pixel order as in Frame.
struct ReferenceFrame {
  Camera camera;
  std::vector<scene::EntityId> ids;  ///< 0: background
  std::vector<double> depth;         ///< metres along forward; NaN: background
  /// Whether the pixel is at an edge. One of its eight neighbours has another id, or its depth
  /// deviates from the pixel's plane by more than a thousandth of the depth.
  std::vector<bool> edge;
  /// A coincident object: within 0.02 mm plus a millionth of the depth.
  struct Tie {
    std::uint32_t pixel;
    scene::EntityId id;
  };
  std::vector<Tie> ties;      ///< sorted by pixel
  std::size_t undecided = 0;  ///< pixels whose search was abandoned after kMaxSteps surfaces
  static constexpr int kMaxSteps = 16;
};

/// Renders reference frames of one scene.
class ReferenceTracer {
 public:
  explicit ReferenceTracer(std::shared_ptr<const scene::Scene> scene, int threads = 2);
  ~ReferenceTracer();
  ReferenceTracer(const ReferenceTracer&) = delete;
  ReferenceTracer& operator=(const ReferenceTracer&) = delete;

  /// `options`: those of the frame to be compared; its channels are ignored. Throws RenderError
  /// like RayRenderer::render().
  ReferenceFrame render(const scene::Snapshot& snapshot, const Camera& camera,
                        const FrameOptions& options = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
