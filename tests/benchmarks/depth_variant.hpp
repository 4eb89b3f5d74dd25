// Alternative depth buffers for the renderer benchmark: all triangles of a scene in one depth-only
// draw.
#pragma once

#include <memory>
#include <string>

#include "render/frame.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::benchmarks {

struct DepthBuffer {
  std::string name;
  bool floats = true;    ///< 32-bit float; otherwise 24-bit fixed point
  bool reversed = true;  ///< near 1, far 0, clipped to 0..1; otherwise OpenGL's default of -1..1
};

class DepthVariant {
 public:
  /// The scene must have no masks and no transparency. Throws RenderError.
  DepthVariant(std::shared_ptr<const scene::Scene> scene, DepthBuffer buffer);
  ~DepthVariant();

  /// Uploads the triangles to the device, relative to the eye.
  void aim(const render::Camera& camera);
  /// The depth of a perspective camera passed to aim() before, as Frame::depth.
  render::Frame draw(const render::Camera& camera);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::benchmarks
