#include "tests/benchmarks/moving_cubes.hpp"

#include <algorithm>
#include <cmath>

namespace enfilade::benchmarks {
namespace {

constexpr double kFrame = 1.0 / 30;  // seconds
constexpr double kMaxStep = 0.2;     // metres a frame
constexpr double kGravity = 9.81;    // metres per second squared
constexpr double kTowerHeight = 3;   // widths
constexpr double kRebound = 0.4;     // of the speed
constexpr double kHeapSpeed = 6;     // metres per second at the heap's surface

Vec3 drawVector(Random& random, const Vec3& low, const Vec3& high) {
  const double x = drawUniform(random, low.x(), high.x());
  const double y = drawUniform(random, low.y(), high.y());
  const double z = drawUniform(random, low.z(), high.z());
  return {x, y, z};
}

}  // namespace

const char* getName(CubeMotion motion) {
  switch (motion) {
    case CubeMotion::brownian:
      return "Brownian";
    case CubeMotion::falling:
      return "falling";
    case CubeMotion::turbulent:
      return "turbulent";
  }
  return "?";
}

MovingCubes::MovingCubes(CubeMotion motion, std::size_t count)
    : motion_(motion), velocities_(count, Vec3::Zero()), boxes_(count) {
  const double n = static_cast<double>(count);
  width_ = motion == CubeMotion::turbulent ? 0.6 * std::cbrt(n)
           : motion == CubeMotion::falling ? std::cbrt(10 * n / kTowerHeight)
                                           : std::cbrt(10 * n);
  const double height = motion == CubeMotion::falling ? kTowerHeight * width_ : width_;
  for (std::size_t k = 0; k < count; ++k) {
    if (motion == CubeMotion::turbulent) {
      centres_.push_back(width_ * std::cbrt(drawUniform(random_, 0, 1)) * drawDirection(random_));
      velocities_[k] = kHeapSpeed * drawUniform(random_, 0, 1) * drawDirection(random_);
    } else {
      centres_.push_back(drawVector(random_, Vec3::Zero(), Vec3(width_, height, width_)));
    }
  }
}

std::span<const Aabb> MovingCubes::next() {
  if (motion_ == CubeMotion::brownian) moveRandomly();
  if (motion_ == CubeMotion::falling) fall();
  if (motion_ == CubeMotion::turbulent) swirl();
  const Vec3 half = Vec3::Constant(0.5);
  for (std::size_t k = 0; k < centres_.size(); ++k)
    boxes_[k] = {centres_[k] - half, centres_[k] + half};
  return boxes_;
}

void MovingCubes::moveRandomly() {
  const Vec3 low = Vec3::Zero(), high = Vec3::Constant(width_);
  for (Vec3& centre : centres_)
    centre = (centre + drawUniform(random_, 0, kMaxStep) * drawDirection(random_))
                 .cwiseMax(low)
                 .cwiseMin(high);
}

void MovingCubes::fall() {
  for (std::size_t k = 0; k < centres_.size(); ++k) {
    velocities_[k].y() -= kGravity * kFrame;
    centres_[k] += kFrame * velocities_[k];
    if (centres_[k].y() > 0.5) continue;
    centres_[k].y() = 0.5;
    velocities_[k] = Vec3(drawUniform(random_, -1, 1), -kRebound * velocities_[k].y(),
                          drawUniform(random_, -1, 1));
  }
}

/// Each cube oscillates about the heap's centre, and chance turns its velocity.
void MovingCubes::swirl() {
  const double rate = kHeapSpeed / width_;
  for (std::size_t k = 0; k < centres_.size(); ++k) {
    velocities_[k] -= rate * rate * kFrame * centres_[k];
    velocities_[k] += 0.2 * velocities_[k].norm() * drawDirection(random_);
    if (velocities_[k].norm() > kHeapSpeed) velocities_[k] *= kHeapSpeed / velocities_[k].norm();
    centres_[k] += kFrame * velocities_[k];
  }
}

WalkingBoxes::WalkingBoxes(std::size_t count, const Vec3& corner)
    : corner_(corner), width_(4 * std::sqrt(static_cast<double>(count))), boxes_(count) {
  for (std::size_t k = 0; k < count; ++k) {
    feet_.push_back(drawVector(random_, Vec3::Zero(), Vec3(width_, 0, width_)));
    const Vec3 towards = drawDirection(random_);
    velocities_.push_back(1.4 * Vec3(towards.x(), 0, towards.z()));
  }
}

std::span<const Aabb> WalkingBoxes::next() {
  for (std::size_t k = 0; k < feet_.size(); ++k) {
    feet_[k] += kFrame * velocities_[k];
    for (const int axis : {0, 2}) {
      const bool isOutside = feet_[k][axis] < 0 || feet_[k][axis] > width_;
      if (isOutside && (feet_[k][axis] < 0) == (velocities_[k][axis] < 0))
        velocities_[k][axis] = -velocities_[k][axis];
    }
    boxes_[k] = {corner_ + feet_[k] - Vec3(0.3, 0, 0.3), corner_ + feet_[k] + Vec3(0.3, 1.75, 0.3)};
  }
  return boxes_;
}

}  // namespace enfilade::benchmarks
