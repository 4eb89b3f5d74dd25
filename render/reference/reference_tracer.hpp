// What a camera really sees, pixel by pixel, in doubles: the truth that pictures are measured with.
// Embree, in single rays, only proposes triangles: all within its rounding of the first are tried
// by exact signs of doubles, and where none holds the search goes on behind them. Some microseconds
// a pixel.
#pragma once

#include <memory>
#include <vector>

#include "render/frame.hpp"
#include "render/render_error.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::render {

/// Pixels as in Frame.
struct TrueFrame {
  Camera camera;
  std::vector<scene::EntityId> ids;  ///< 0: nothing
  std::vector<double> depth;         ///< metres along forward; NaN: nothing
  /// Whether the pixel lies at an edge: one of its eight neighbours shows another object, or
  /// nothing, or lies farther than a thousandth of the depth from the plane that the pixel sees.
  std::vector<bool> edge;
  /// Another object in the same place: within 0.02 mm and a millionth of the depth.
  struct Tie {
    std::uint32_t pixel;
    scene::EntityId id;
  };
  std::vector<Tie> ties;      ///< ascending pixels
  std::size_t undecided = 0;  ///< pixels whose search was given up after kMostSteps surfaces
  static constexpr int kMostSteps = 16;
};

class TrueRays {
 public:
  explicit TrueRays(std::shared_ptr<const scene::Scene> scene, int threads = 2);
  ~TrueRays();
  TrueRays(const TrueRays&) = delete;
  TrueRays& operator=(const TrueRays&) = delete;

  /// `options` as for the picture that is to be measured; its channels do not matter. Throws
  /// RenderError as RayRenderer does.
  TrueFrame look(const scene::Snapshot& snapshot, const Camera& camera,
                 const FrameOptions& options = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
