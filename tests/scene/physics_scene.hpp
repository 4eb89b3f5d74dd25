// Test fixture for dynamic bodies: boxes, balls and floors; every pair is a candidate.
#pragma once

#include <deque>
#include <vector>

#include "collision/shapes/hull.hpp"
#include "scene/physics/physics_step.hpp"
#include "scene/physics/physics_world.hpp"

namespace enfilade::scene {

inline collision::Hull makeBoxHull(const Vec3& half) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back((i & 1) ? half.x() : -half.x(), (i & 2) ? half.y() : -half.y(),
                         (i & 4) ? half.z() : -half.z());
  return collision::buildHull(corners);
}

/// A ball of many faces: the grid points of a cube's surface, projected onto a sphere.
inline collision::Hull makeBallHull(double radius, int cuts = 6) {
  std::vector<Vec3> points;
  for (int i = 0; i <= cuts; ++i)
    for (int j = 0; j <= cuts; ++j)
      for (int k = 0; k <= cuts; ++k)
        if (i % cuts == 0 || j % cuts == 0 || k % cuts == 0)
          points.push_back(radius * (Vec3(i, j, k) - Vec3::Constant(0.5 * cuts)).normalized());
  return collision::buildHull(points);
}

/// A rotation about an axis by 2 atan(half), computed without a sine.
inline Quat turnBy(const Vec3& axis, double half) {
  Quat q(1, half * axis.x(), half * axis.y(), half * axis.z());
  const double length = std::sqrt(q.squaredNorm());
  q.coeffs() /= length;
  return q;
}

inline void addParts(std::span<const collision::Hull* const> hulls, PhysicsBody& body) {
  for (const collision::Hull* hull : hulls) {
    body.parts.push_back(makeConvexPart(*hull));
    for (const Vec3& v : hull->vertices)  // the factor exceeds the rounding error
      body.radius = std::max(body.radius, (v - body.centreInFrame).norm() * (1 + 0x1p-48));
  }
  updateTransform(body);
}

/// Returns a dynamic body at rest whose frame has its origin at `worldFromBody`.
inline BodyMotion makeDynamicMotion(const MassProperties& properties,
                                    const collision::Pose& worldFromBody) {
  BodyMotion motion;
  motion.rotation = worldFromBody.rotation;
  motion.centre =
      worldFromBody.rotation.toRotationMatrix() * properties.centre + worldFromBody.translation;
  motion.inverseMass = 1 / properties.mass;
  motion.inertia = properties.inertia;
  motion.inverseInertia = properties.inertia.inverse();
  return motion;
}

/// Makes a dynamic body of convex parts (hulls in one frame; uniform `density` in kg/m^3).
inline PhysicsBody makeDynamicBody(std::span<const collision::Hull* const> hulls, double density,
                                   const collision::Pose& worldFromFrame) {
  std::vector<MassProperties> masses;
  for (const collision::Hull* hull : hulls) masses.push_back(computeHullMass(*hull, density));
  const MassProperties whole = combineMassProperties(masses);
  PhysicsBody body;
  body.motion = makeDynamicMotion(whole, worldFromFrame);
  body.centreInFrame = whole.centre;
  addParts(hulls, body);
  return body;
}

/// Makes a kinematic or static body of hulls; its centre is the frame's origin.
inline PhysicsBody makeKinematicBody(std::span<const collision::Hull* const> hulls,
                                     const collision::Pose& worldFromFrame) {
  PhysicsBody body;
  body.motion.rotation = worldFromFrame.rotation;
  body.motion.centre = worldFromFrame.translation;
  addParts(hulls, body);
  return body;
}

/// Kinetic energy in joules; 0 for a body that impulses do not move.
inline double computeKineticEnergy(const BodyMotion& motion) {
  if (motion.inverseMass == 0) return 0;
  const Vec3 angularVelocity =
      motion.rotation.toRotationMatrix().transpose() * motion.angularVelocity;
  return 0.5 * (motion.velocity.squaredNorm() / motion.inverseMass +
                angularVelocity.dot(motion.inertia * angularVelocity));
}

struct RigidScene {
  std::deque<collision::Hull> hulls;
  PhysicsWorld dynamics;
  StepSettings settings;

  std::uint32_t addFree(const collision::Hull& hull, const Vec3& at,
                        const Quat& rotation = Quat::Identity(), double density = 500) {
    hulls.push_back(hull);
    const collision::Hull* part = &hulls.back();
    return add(makeDynamicBody({&part, 1}, density, {rotation, at}));
  }
  std::uint32_t addStill(const collision::Hull& hull, const Vec3& at,
                         const Quat& rotation = Quat::Identity()) {
    hulls.push_back(hull);
    const collision::Hull* part = &hulls.back();
    return add(makeKinematicBody({&part, 1}, {rotation, at}));
  }
  /// The floor's top is at height 0.
  std::uint32_t addFloor() { return addStill(makeBoxHull({20, 0.5, 20}), {0, -0.5, 0}); }

  std::uint32_t add(PhysicsBody solid) {
    dynamics.bodies.push_back(std::move(solid));
    return static_cast<std::uint32_t>(dynamics.bodies.size() - 1);
  }
  /// Adds all pairs of parts with at least one dynamic part.
  void pairAll() {
    std::vector<PartPairKey> keys;
    const auto& solids = dynamics.bodies;
    const auto countParts = [](const PhysicsBody& s) {
      return static_cast<std::uint32_t>(s.parts.size() + (s.mesh ? s.mesh->triangles().size() : 0));
    };
    for (std::uint32_t a = 0; a < solids.size(); ++a)
      for (std::uint32_t b = a + 1; b < solids.size(); ++b)
        for (std::uint32_t p = 0; p < countParts(solids[a]); ++p)
          for (std::uint32_t q = 0; q < countParts(solids[b]); ++q)
            if (solids[a].isDynamic() || solids[b].isDynamic()) keys.push_back({a, b, p, q});
    setPairs(dynamics, keys);
  }
  StepReport run(int steps) {
    StepReport report;
    for (int i = 0; i < steps; ++i) report = stepPhysics(dynamics, settings);
    return report;
  }
  BodyMotion& getBody(std::uint32_t solid) { return dynamics.bodies[solid].motion; }
  bool isAsleep(std::uint32_t solid) const { return dynamics.bodies[solid].asleep; }

  /// Energy of all dynamic bodies, J; potential energy is relative to height 0.
  double computeEnergy() const {
    double sum = 0;
    for (const PhysicsBody& solid : dynamics.bodies)
      if (solid.isDynamic())
        sum += computeKineticEnergy(solid.motion) -
               settings.solver.gravity.dot(solid.motion.centre) / solid.motion.inverseMass;
    return sum;
  }
  /// Whether any candidate pair penetrates now.
  bool isAnyPenetrating() const {
    for (const BodyPair& pair : dynamics.pairs) {
      collision::FeatureCache cache;
      const auto a = placePart(dynamics.bodies[pair.key.a], pair.key.partA);
      const auto b = placePart(dynamics.bodies[pair.key.b], pair.key.partB);
      if (collision::computeSeparation(a, b, cache).verdict == collision::Verdict::penetrating)
        return true;
    }
    return false;
  }
};

}  // namespace enfilade::scene
