// A box is occluded if its nearest point is behind the farthest depth of all pixels that its
// projection may cover. The test depends only on the depth buffer:
//
// - Pixels: the projected corners' bounds, extended by kPixelSlack on each side. A triangle in the
//   box covers no other pixels. Rasterisers move corners by less than 1/100 of a pixel (1/256 for
//   their grid, plus the rounding of clipping).
// - Depth: the nearest corner's, extended by the rasteriser's error. It interpolates in floats from
//   the triangle's corners; the error is about 2^-24 of the triangle's maximum depth per pixel of
//   slope. kRelativeSlack and kTriangleSlack are a thousand times that. They do not bound triangles
//   thinner than 1/256 of a pixel: the grid is coarser than those, so their depth is arbitrary.
// - A box that crosses the near plane is not tested as a whole, but subdivided.
#include "render/culling/box_visibility.hpp"

#include <algorithm>
#include <cmath>

namespace enfilade::render {
namespace {

constexpr double kPixelSlack = 0.5;      // pixels
constexpr double kRelativeSlack = 1e-4;  // of a sub-box's depth
constexpr float kTriangleSlack = 1e-6f;  // of the whole box's depth; the triangle may span the box
constexpr float kParallelSlack = 1e-5f;  // orthographic: of far - near
constexpr int kMaxHalvings = 6;          // up to 2^6 sub-boxes
constexpr int kSmallBoxThreshold = 6;    // pixels; smaller projections are not subdivided

}  // namespace

struct BoxVisibility::Extent {
  PixelRect pixels;
  double nearest;  ///< metres along forward
};

BoxVisibility::BoxVisibility(const Camera& camera)
    : camera_(camera),
      basis_(computeCameraBasis(camera)),
      eye_(camera.eye),
      planes_(computeFrustum(camera)),
      perspective_(camera.projection == Camera::Projection::perspective) {
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    // The slack covers the frame's single precision: a box that touches a plane is drawn.
    slacks_[i] = 1e-5 * (1 + std::abs(planes_[i].offset));
    planes_[i].offset += planes_[i].normal.dot(eye_);
  }
}

bool BoxVisibility::isOutsideFrustum(const EyeSpaceAabb& box) const {
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const Plane& side = planes_[i];
    const double projectedRadius = side.normal.cwiseAbs().dot(box.halfExtent);
    if (side.normal.dot(box.centre) + side.offset + projectedRadius < -slacks_[i]) return true;
  }
  return false;
}

float BoxVisibility::computeBufferDepth(double z) const {
  const double range = camera_.far - camera_.near;
  const double depth =
      perspective_ ? camera_.near * (camera_.far - z) / (z * range) : (camera_.far - z) / range;
  return static_cast<float>(std::clamp(depth, 0.0, 1.0));
}

/// Projects the box to pixels. False if it crosses the near plane. Outside the image, the rectangle
/// is empty: right < left, or bottom < top.
bool BoxVisibility::projectBox(const EyeSpaceAabb& box, Extent& extent) const {
  const double z = basis_.forward.dot(box.centre);
  const double projectedRadius = basis_.forward.cwiseAbs().dot(box.halfExtent);
  extent.nearest = z - projectedRadius;
  if (perspective_ && extent.nearest < camera_.near) return false;
  const double halfWidth = 0.5 * camera_.width, halfHeight = 0.5 * camera_.height;
  const double x = halfWidth * basis_.scaleX * basis_.right.dot(box.centre);
  const double y = -halfHeight * basis_.scaleY * basis_.up.dot(box.centre);
  const Vec3 xs = halfWidth * basis_.scaleX * basis_.right.cwiseProduct(box.halfExtent);
  const Vec3 ys = -halfHeight * basis_.scaleY * basis_.up.cwiseProduct(box.halfExtent);
  const Vec3 zs = basis_.forward.cwiseProduct(box.halfExtent);
  double left = 1e300, right = -1e300, top = 1e300, bottom = -1e300;
  for (int corner = 0; corner < 8; ++corner) {
    const double a = (corner & 1) ? 1 : -1, b = (corner & 2) ? 1 : -1, c = (corner & 4) ? 1 : -1;
    const double shrink = perspective_ ? 1 / (z + a * zs.x() + b * zs.y() + c * zs.z()) : 1.0;
    const double column = (x + a * xs.x() + b * xs.y() + c * xs.z()) * shrink;
    const double row = (y + a * ys.x() + b * ys.y() + c * ys.z()) * shrink;
    left = std::min(left, column);
    right = std::max(right, column);
    top = std::min(top, row);
    bottom = std::max(bottom, row);
  }
  const double middleX = halfWidth * (1 + basis_.shiftX),
               middleY = halfHeight * (1 - basis_.shiftY);
  // The centre of pixel i is at i + 1/2.
  const auto first = [](double low, int count) {
    return static_cast<int>(std::clamp(std::ceil(low - 0.5 - kPixelSlack), 0.0, count + 0.0));
  };
  const auto last = [](double high, int count) {
    return static_cast<int>(std::clamp(std::floor(high - 0.5 + kPixelSlack), -1.0, count - 1.0));
  };
  extent.pixels = {first(middleX + left, camera_.width), first(middleY + top, camera_.height),
                   last(middleX + right, camera_.width), last(middleY + bottom, camera_.height)};
  return true;
}

Visibility BoxVisibility::testWhole(const EyeSpaceAabb& box, const DepthPyramid& depth) const {
  if (isOutsideFrustum(box)) return Visibility::culled;
  Extent extent;
  if (!projectBox(box, extent)) return Visibility::visible;
  const PixelRect& pixels = extent.pixels;
  if (pixels.right < pixels.left || pixels.bottom < pixels.top) return Visibility::culled;
  const float nearest = computeBufferDepth(extent.nearest);
  const float slack = perspective_ ? kTriangleSlack * nearest : kParallelSlack;
  const auto inflatedDepth = static_cast<float>(nearest * (1 + kRelativeSlack)) + slack;
  return depth.isOccluded(pixels, inflatedDepth) ? Visibility::occluded : Visibility::visible;
}

Visibility BoxVisibility::testRecursive(const EyeSpaceAabb& box, const DepthPyramid& depth,
                                        float slack, int halvings) const {
  if (isOutsideFrustum(box)) return Visibility::culled;
  Extent extent;
  if (projectBox(box, extent)) {
    const PixelRect& pixels = extent.pixels;
    const int width = pixels.right - pixels.left, height = pixels.bottom - pixels.top;
    if (width < 0 || height < 0) return Visibility::culled;
    const auto inflatedDepth =
        static_cast<float>(computeBufferDepth(extent.nearest) * (1 + kRelativeSlack)) + slack;
    if (depth.isOccluded(pixels, inflatedDepth)) return Visibility::occluded;
    if (width <= kSmallBoxThreshold && height <= kSmallBoxThreshold) return Visibility::visible;
  }
  if (halvings == 0) return Visibility::visible;
  int axis = 0;
  box.halfExtent.maxCoeff(&axis);
  EyeSpaceAabb halfBox = box;
  halfBox.halfExtent[axis] *= 0.5;
  halfBox.centre[axis] = box.centre[axis] - halfBox.halfExtent[axis];
  const Visibility one = testRecursive(halfBox, depth, slack, halvings - 1);
  if (one == Visibility::visible) return one;
  halfBox.centre[axis] = box.centre[axis] + halfBox.halfExtent[axis];
  const Visibility other = testRecursive(halfBox, depth, slack, halvings - 1);
  return one == Visibility::occluded && other == Visibility::culled ? one : other;
}

Visibility BoxVisibility::test(const EyeSpaceAabb& box, const DepthPyramid& depth) const {
  const double nearest =
      basis_.forward.dot(box.centre) - basis_.forward.cwiseAbs().dot(box.halfExtent);
  const float whole = perspective_ ? computeBufferDepth(std::max(nearest, camera_.near)) : 1;
  const float slack = perspective_ ? kTriangleSlack * whole : kParallelSlack;
  return testRecursive(box, depth, slack, kMaxHalvings);
}

}  // namespace enfilade::render
