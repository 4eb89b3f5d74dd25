// The gyroscopic term by implicit Euler in the body's axes,
//   f(w') = I (w' - w) + t w' x I w' = 0,
// by Newton's method (E. Catto, "Numerical Methods", Game Developers Conference 2015, takes one
// step). Where f is zero, w' . I w' = w' . I w, so by Cauchy and Schwarz the energy cannot grow;
// what the last step leaves of f is taken off by scaling.
#include "scene/physics/body_motion.hpp"

#include <cmath>

namespace enfilade::scene {
namespace {

constexpr int kNewtonSteps = 3;

/// x for which x0 c0 + x1 c1 + x2 c2 = f, by Cramer's rule.
Vec3 solved(const Vec3& c0, const Vec3& c1, const Vec3& c2, const Vec3& f) {
  const Vec3 across = c1.cross(c2);
  return Vec3(f.dot(across), f.dot(c2.cross(c0)), f.dot(c0.cross(c1))) / c0.dot(across);
}

/// Newton's step: f(spin), by the inverse of its slope.
Vec3 newtonStep(const Mat3& inertia, const Vec3& before, const Vec3& spin, double seconds) {
  const Vec3 momentum = inertia * spin;
  const Vec3 f = inertia * (spin - before) + seconds * spin.cross(momentum);
  const auto slope = [&](int k) {
    const Vec3 column = inertia.col(k);
    return Vec3(column + seconds * (spin.cross(column) - momentum.cross(Vec3::Unit(k))));
  };
  return solved(slope(0), slope(1), slope(2), f);
}

}  // namespace

RigidBody freeBody(const MassProperties& properties, const collision::Pose& worldFromBody) {
  RigidBody body;
  body.rotation = worldFromBody.rotation;
  body.centre =
      worldFromBody.rotation.toRotationMatrix() * properties.centre + worldFromBody.translation;
  body.inverseMass = 1 / properties.mass;
  body.inertia = properties.inertia;
  body.inverseInertia = properties.inertia.inverse();
  return body;
}

void advance(RigidBody& body, double seconds) {
  body.centre += seconds * body.velocity;
  const Vec3 half = 0.5 * seconds * body.spin;
  const Quat turn(1, half.x(), half.y(), half.z());
  body.rotation = turn * body.rotation;
  const double length = std::sqrt(body.rotation.squaredNorm());
  body.rotation.coeffs() /= length;
}

void bendSpin(RigidBody& body, double seconds) {
  if (body.inverseMass == 0) return;
  const Mat3 rotation = body.rotation.toRotationMatrix();
  const Vec3 before = rotation.transpose() * body.spin;
  Vec3 spin = before;
  for (int i = 0; i < kNewtonSteps; ++i) spin -= newtonStep(body.inertia, before, spin, seconds);
  const double energy = before.dot(body.inertia * before), after = spin.dot(body.inertia * spin);
  if (!(after <= energy))
    spin = std::isfinite(after) ? Vec3(std::sqrt(energy / after) * spin) : before;
  body.spin = rotation * spin;
}

Mat3 worldInverseInertia(const RigidBody& body) {
  const Mat3 rotation = body.rotation.toRotationMatrix();
  return rotation * body.inverseInertia * rotation.transpose();
}

double kineticEnergy(const RigidBody& body) {
  if (body.inverseMass == 0) return 0;
  const Vec3 spin = body.rotation.toRotationMatrix().transpose() * body.spin;
  return 0.5 * (body.velocity.squaredNorm() / body.inverseMass + spin.dot(body.inertia * spin));
}

}  // namespace enfilade::scene
