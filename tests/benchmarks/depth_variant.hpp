// How other depth buffers would do: all triangles of a scene in one draw, depth alone. For the
// benchmark of renderers only.
#pragma once

#include <memory>
#include <string>

#include "render/frame.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::benchmarks {

struct DepthBuffer {
  std::string name;
  bool floats = true;    ///< 32 bits of float; else 24 of fixed point
  bool reversed = true;  ///< near 1, far 0, clipped to 0..1; else -1..1 as OpenGL began
};

class DepthVariant {
 public:
  /// Of a scene without masks and glass. Throws RenderError.
  DepthVariant(std::shared_ptr<const scene::Scene> scene, DepthBuffer buffer);
  ~DepthVariant();

  /// Brings the triangles to the device, relative to the eye.
  void aim(const render::Camera& camera);
  /// The depth of a perspective camera aimed at before, as Frame::depth.
  render::Frame draw(const render::Camera& camera);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::benchmarks
