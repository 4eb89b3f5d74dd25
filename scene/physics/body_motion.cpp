// Gyroscopic term by implicit Euler in body axes:
//   f(w') = I (w' - w) + t w' x I w' = 0,
// solved by Newton's method (E. Catto, "Numerical Methods", Game Developers Conference 2015, takes
// one iteration). Where f is zero, w' . I w' = w' . I w. By Cauchy-Schwarz the energy then cannot
// grow. Scaling removes the residual that the last iteration leaves.
#include "scene/physics/body_motion.hpp"

#include <cmath>

#include "collision/assert.hpp"

namespace enfilade::scene {
namespace {

constexpr int kNewtonIterations = 3;

/// Solves x0 c0 + x1 c1 + x2 c2 = f by Cramer's rule.
Vec3 solveLinear3(const Vec3& c0, const Vec3& c1, const Vec3& c2, const Vec3& f) {
  const Vec3 cross12 = c1.cross(c2);
  return Vec3(f.dot(cross12), f.dot(c2.cross(c0)), f.dot(c0.cross(c1))) / c0.dot(cross12);
}

/// Newton step: the inverse Jacobian of f times f(angularVelocity).
Vec3 computeNewtonStep(const Mat3& inertia, const Vec3& before, const Vec3& angularVelocity,
                       double seconds) {
  const Vec3 momentum = inertia * angularVelocity;
  const Vec3 f = inertia * (angularVelocity - before) + seconds * angularVelocity.cross(momentum);
  const auto jacobianColumn = [&](int k) {
    const Vec3 column = inertia.col(k);
    return Vec3(column + seconds * (angularVelocity.cross(column) - momentum.cross(Vec3::Unit(k))));
  };
  return solveLinear3(jacobianColumn(0), jacobianColumn(1), jacobianColumn(2), f);
}

}  // namespace

void integratePose(BodyMotion& motion, double seconds) {
  motion.centre += seconds * motion.velocity;
  const Vec3 half = 0.5 * seconds * motion.angularVelocity;
  const Quat rotationStep(1, half.x(), half.y(), half.z());
  motion.rotation = rotationStep * motion.rotation;
  const double length = std::sqrt(motion.rotation.squaredNorm());
  motion.rotation.coeffs() /= length;
}

void applyGyroscopicTorque(BodyMotion& motion, double seconds) {
  if (motion.inverseMass == 0) return;
  const Mat3 rotation = motion.rotation.toRotationMatrix();
  const Vec3 before = rotation.transpose() * motion.angularVelocity;
  Vec3 angularVelocity = before;
  for (int i = 0; i < kNewtonIterations; ++i)
    angularVelocity -= computeNewtonStep(motion.inertia, before, angularVelocity, seconds);
  const double energy = before.dot(motion.inertia * before),
               after = angularVelocity.dot(motion.inertia * angularVelocity);
  if (!(after <= energy))
    angularVelocity =
        std::isfinite(after) ? Vec3(std::sqrt(energy / after) * angularVelocity) : before;
  motion.angularVelocity = rotation * angularVelocity;
}

Mat3 computeWorldInverseInertia(const BodyMotion& motion) {
  const Mat3 rotation = motion.rotation.toRotationMatrix();
  return rotation * motion.inverseInertia * rotation.transpose();
}

}  // namespace enfilade::scene
