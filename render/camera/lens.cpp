#include "render/camera/lens.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/camera/fisheye.hpp"

namespace enfilade::render {
namespace {

constexpr double kPi = std::numbers::pi;

/// A lower bound of the slope of distort() between two angles.
double boundSlope(const std::array<double, 4>& k, double low, double high) {
  double slope = 1, lowPower = 1, highPower = 1;
  for (std::size_t i = 0; i < k.size(); ++i) {
    lowPower *= low * low;
    highPower *= high * high;
    slope += (2 * static_cast<double>(i) + 3) * k[i] * (k[i] > 0 ? lowPower : highPower);
  }
  return slope;
}

/// The angle between `low` and `high` up to which the model increases; to 1e-6 of pi.
double findMaxAngle(const std::array<double, 4>& k, double low, double high) {
  if (boundSlope(k, low, high) > 0) return high;
  if (high - low < 1e-6 * kPi) return low;
  const double middle = 0.5 * (low + high);
  const double angle = findMaxAngle(k, low, middle);
  return angle < middle ? angle : findMaxAngle(k, middle, high);
}

}  // namespace

LensMapping::LensMapping(const Camera& camera)
    : lens_(*camera.lens), width_(camera.width), height_(camera.height) {
  forward_ = camera.forward.stableNormalized();
  right_ = forward_.cross(camera.up.stableNormalized()).normalized();
  up_ = right_.cross(forward_);
  if (lens_.kind == Camera::Lens::Kind::fisheye) {
    pinhole_ = computeFisheyeIntrinsics(camera);
    pixelsPerRadian_ = std::max(pinhole_.fx, pinhole_.fy);
    maxAngle_ = findMaxAngle(lens_.k, 0, kPi);
  } else {
    pixelsPerRadian_ = std::max(width_ / (2 * kPi), height_ / kPi);
  }
}

/// The inverse of distort(), by bisection; nullopt: beyond the model.
std::optional<double> LensMapping::findAngle(double radius) const {
  double low = 0, high = maxAngle_;
  if (radius > distort(lens_.k, high)) return std::nullopt;
  if (lens_.k == std::array<double, 4>{}) return radius;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (distort(lens_.k, middle) < radius ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

std::optional<Vec3> LensMapping::directionAt(double x, double y) const {
  x += lens_.offsetX;
  y += lens_.offsetY;
  if (lens_.kind == Camera::Lens::Kind::equirectangular) {
    const double yaw = (x / width_ - 0.5) * 2 * kPi, pitch = (0.5 - y / height_) * kPi;
    return Vec3(std::cos(pitch) * (std::cos(yaw) * forward_ + std::sin(yaw) * right_) +
                std::sin(pitch) * up_);
  }
  const double u = (x - pinhole_.cx) / pinhole_.fx, v = (y - pinhole_.cy) / pinhole_.fy;
  const double radius = std::hypot(u, v);
  const auto angle = findAngle(radius);
  if (!angle) return std::nullopt;
  if (radius == 0) return forward_;
  const double across = std::sin(*angle) / radius;
  return Vec3(std::cos(*angle) * forward_ + across * (u * right_ - v * up_));
}

}  // namespace enfilade::render
