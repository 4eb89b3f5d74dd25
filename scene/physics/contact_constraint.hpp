// Where two bodies lean on one another, as the solver sees it: some points and one normal.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "scene/physics/body_motion.hpp"

namespace enfilade::scene {

/// World axes, metres from the bodies' centres, newton seconds a substep.
struct PatchPoint {
  Vec3 armA = Vec3::Zero(), armB = Vec3::Zero();
  double separation = 0;  ///< along the normal; negative where they penetrate
  double impulse = 0;     ///< along the normal: what the next solution starts from
  double push = 0;        ///< the same, of ContactPatch::mostPush
};

struct ContactPatch {
  static constexpr std::size_t kMostPoints = 4;

  std::uint32_t a = 0, b = 0;   ///< indices of the bodies
  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B
  double friction = 0, restitution = 0;
  std::array<PatchPoint, kMostPoints> points;
  std::size_t size = 0;
  Vec3 rub = Vec3::Zero();  ///< impulse of friction on B, at right angles to the normal
  double twist = 0;         ///< impulse of friction against turning about the normal, on B
  /// Who walks against a body pushes it: besides holding firm, the patch gives its points up to
  /// `mostPush` newtons in all, until they part at `pushSpeed` m/s. 0: no push.
  double pushSpeed = 0, mostPush = 0;
  bool pushed = false;  ///< a point gave an impulse in the last step: they met in it

  std::span<const PatchPoint> list() const { return {points.data(), size}; }
};

/// Of all points, without pushes; N s.
inline double normalImpulse(const ContactPatch& patch) {
  double sum = 0;
  for (const PatchPoint& point : patch.list()) sum += point.impulse + point.push;
  return sum;
}

}  // namespace enfilade::scene
