// A box is hidden when its nearest point lies behind the farthest depth of all pixels that its
// picture may cover. Nothing of that depends on who drew what, only on the depth that is there:
//
// - The pixels: the corners' picture, grown by kPixelSlack on each side. A triangle in the box
//   covers none but those (its picture is in that of the box, and rasterisers move corners by less
//   than 1/100 of a pixel: by 1/256 to their grid and by the rounding of clipping).
// - The depth: the nearest corner's, grown by what a rasteriser may add. It interpolates along the
//   picture from the triangle's corners, in floats: some 2^-24 of the greatest depth of the
//   triangle for each pixel that it is steep. kRelativeSlack and kTriangleSlack are a thousand
//   times that. What they do not bound are triangles thinner than 1/256 of a pixel: there the grid
//   is coarser than the triangle, and what is interpolated may lie anywhere.
// - A box that comes nearer than the near plane is not looked at as a whole: its pieces are.
#include "render/gl/box_visibility.hpp"

#include <algorithm>
#include <cmath>

namespace enfilade::render {
namespace {

constexpr double kPixelSlack = 0.5;      // pixels
constexpr double kRelativeSlack = 1e-4;  // of a piece's depth
constexpr float kTriangleSlack = 1e-6f;  // of the depth of the whole box, which holds the triangle
constexpr float kParallelSlack = 1e-5f;  // orthographic: of near..far
constexpr int kMostHalvings = 6;         // a box is looked at in up to 2^6 pieces
constexpr int kSmallPicture = 6;         // pixels; what is smaller is not cut any more

}  // namespace

struct BoxSight::Extent {
  PixelRect pixels;
  double nearest;  ///< metres along forward
};

BoxSight::BoxSight(const Camera& camera)
    : camera_(camera),
      view_(viewOf(camera)),
      eye_(camera.eye),
      sides_(frustumOf(camera)),
      perspective_(camera.projection == Camera::Projection::perspective) {
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    slacks_[i] = 1e-5 * (1 + std::abs(sides_[i].offset));  // as mayBeSeen
    sides_[i].offset += sides_[i].normal.dot(eye_);
  }
}

bool BoxSight::outside(const EyeBox& box) const {
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    const Plane& side = sides_[i];
    const double reach = side.normal.cwiseAbs().dot(box.half);
    if (side.normal.dot(box.centre) + side.offset + reach < -slacks_[i]) return true;
  }
  return false;
}

float BoxSight::depthAt(double z) const {
  const double range = camera_.far - camera_.near;
  const double depth =
      perspective_ ? camera_.near * (camera_.far - z) / (z * range) : (camera_.far - z) / range;
  return static_cast<float>(std::clamp(depth, 0.0, 1.0));
}

/// False when the box comes too near for a picture of it. Otherwise its pixels in the picture (none
/// when it lies beside it: right < left, or bottom < top).
bool BoxSight::ahead(const EyeBox& box, Extent& extent) const {
  const double z = view_.forward.dot(box.centre);
  const double reach = view_.forward.cwiseAbs().dot(box.half);
  extent.nearest = z - reach;
  if (perspective_ && extent.nearest < camera_.near) return false;
  const double halfWidth = 0.5 * camera_.width, halfHeight = 0.5 * camera_.height;
  const double x = halfWidth * view_.scaleX * view_.right.dot(box.centre);
  const double y = -halfHeight * view_.scaleY * view_.up.dot(box.centre);
  const Vec3 xs = halfWidth * view_.scaleX * view_.right.cwiseProduct(box.half);
  const Vec3 ys = -halfHeight * view_.scaleY * view_.up.cwiseProduct(box.half);
  const Vec3 zs = view_.forward.cwiseProduct(box.half);
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
  const double middleX = halfWidth * (1 + view_.shiftX), middleY = halfHeight * (1 - view_.shiftY);
  // Pixel i has its centre at i + 1/2.
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

Sight BoxSight::glance(const EyeBox& box, const DepthPyramid& depth) const {
  if (outside(box)) return Sight::outside;
  Extent extent;
  if (!ahead(box, extent)) return Sight::maybe;
  const PixelRect& pixels = extent.pixels;
  if (pixels.right < pixels.left || pixels.bottom < pixels.top) return Sight::outside;
  const float nearest = depthAt(extent.nearest);
  const float slack = perspective_ ? kTriangleSlack * nearest : kParallelSlack;
  const auto grown = static_cast<float>(nearest * (1 + kRelativeSlack)) + slack;
  return depth.hides(pixels, grown) ? Sight::hidden : Sight::maybe;
}

Sight BoxSight::piece(const EyeBox& box, const DepthPyramid& depth, float slack,
                      int halvings) const {
  if (outside(box)) return Sight::outside;
  Extent extent;
  if (ahead(box, extent)) {
    const PixelRect& pixels = extent.pixels;
    const int width = pixels.right - pixels.left, height = pixels.bottom - pixels.top;
    if (width < 0 || height < 0) return Sight::outside;
    const auto grown = static_cast<float>(depthAt(extent.nearest) * (1 + kRelativeSlack)) + slack;
    if (depth.hides(pixels, grown)) return Sight::hidden;
    if (width <= kSmallPicture && height <= kSmallPicture) return Sight::maybe;
  }
  if (halvings == 0) return Sight::maybe;
  int axis = 0;
  box.half.maxCoeff(&axis);
  EyeBox part = box;
  part.half[axis] *= 0.5;
  part.centre[axis] = box.centre[axis] - part.half[axis];
  const Sight one = piece(part, depth, slack, halvings - 1);
  if (one == Sight::maybe) return one;
  part.centre[axis] = box.centre[axis] + part.half[axis];
  const Sight other = piece(part, depth, slack, halvings - 1);
  return one == Sight::hidden && other == Sight::outside ? one : other;
}

Sight BoxSight::look(const EyeBox& box, const DepthPyramid& depth) const {
  const double nearest = view_.forward.dot(box.centre) - view_.forward.cwiseAbs().dot(box.half);
  const float whole = perspective_ ? depthAt(std::max(nearest, camera_.near)) : 1;
  const float slack = perspective_ ? kTriangleSlack * whole : kParallelSlack;
  return piece(box, depth, slack, kMostHalvings);
}

}  // namespace enfilade::render
