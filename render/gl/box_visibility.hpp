// Whether a camera may see anything of a box, given the depth of what is drawn. Knows no GL.
#pragma once

#include "render/camera_basis.hpp"
#include "render/gl/depth_pyramid.hpp"

namespace enfilade::render {

/// `outside` and `hidden` are proved: no triangle in the box has a pixel of the picture.
enum class Sight : std::uint8_t { outside, hidden, maybe };

/// A box as its centre and half of its size, metres, relative to the eye, world axes.
struct EyeBox {
  Vec3 centre, half;
};

class BoxSight {
 public:
  explicit BoxSight(const Camera& camera);

  EyeBox relative(const scene::Box& box) const { return {box.centre() - eye_, 0.5 * box.size()}; }
  bool outside(const EyeBox& box) const;
  /// One look at the box as a whole.
  Sight glance(const EyeBox& box, const DepthPyramid& depth) const;
  /// As glance(), but a box that is not hidden as a whole is looked at in pieces.
  Sight look(const EyeBox& box, const DepthPyramid& depth) const;

 private:
  struct Extent;
  bool ahead(const EyeBox& box, Extent& extent) const;
  Sight piece(const EyeBox& box, const DepthPyramid& depth, float slack, int depthLeft) const;
  float depthAt(double z) const;

  Camera camera_;
  View view_;
  Vec3 eye_;
  std::array<Plane, 6> sides_;    ///< about the eye
  std::array<double, 6> slacks_;  ///< metres
  bool perspective_;
};

}  // namespace enfilade::render
