// Frustum and occlusion tests of boxes against a depth pyramid. Independent of OpenGL.
#pragma once

#include "render/camera/camera.hpp"
#include "render/culling/depth_pyramid.hpp"

namespace enfilade::render {

/// `culled` (outside the frustum) and `occluded` are certain: no triangle in the box affects a
/// pixel. `visible` means possibly visible.
enum class Visibility : std::uint8_t { culled, occluded, visible };

/// A box as centre and half extent, metres, relative to the eye, world axes.
struct EyeSpaceAabb {
  Vec3 centre, halfExtent;
};

/// Visibility tests for one camera.
class BoxVisibility {
 public:
  explicit BoxVisibility(const Camera& camera);

  EyeSpaceAabb toEyeSpace(const scene::Aabb& box) const {
    return {box.centre() - eye_, 0.5 * box.size()};
  }
  bool isOutsideFrustum(const EyeSpaceAabb& box) const;
  /// Tests the box as a whole.
  Visibility testWhole(const EyeSpaceAabb& box, const DepthPyramid& depth) const;
  /// As testWhole(), but subdivides a box that is not occluded as a whole.
  Visibility test(const EyeSpaceAabb& box, const DepthPyramid& depth) const;

 private:
  struct Extent;
  bool projectBox(const EyeSpaceAabb& box, Extent& extent) const;
  Visibility testRecursive(const EyeSpaceAabb& box, const DepthPyramid& depth, float slack,
                           int halvings) const;
  float computeBufferDepth(double z) const;

  Camera camera_;
  CameraBasis basis_;
  Vec3 eye_;
  std::array<Plane, 6> planes_;   ///< frustum planes relative to the eye
  std::array<double, 6> slacks_;  ///< metres
  bool perspective_;
};

}  // namespace enfilade::render
