// Boxes, balls and floors for the tests of free bodies; every pair may meet.
#pragma once

#include <deque>
#include <vector>

#include "collision/shapes/hull.hpp"
#include "scene/physics/physics_world.hpp"

namespace enfilade::scene {

inline collision::Hull boxHull(const Vec3& half) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back((i & 1) ? half.x() : -half.x(), (i & 2) ? half.y() : -half.y(),
                         (i & 4) ? half.z() : -half.z());
  return collision::buildHull(corners);
}

/// A ball of many faces: the corners of a cube's grid, blown up to a sphere.
inline collision::Hull ballHull(double radius, int cuts = 6) {
  std::vector<Vec3> points;
  for (int i = 0; i <= cuts; ++i)
    for (int j = 0; j <= cuts; ++j)
      for (int k = 0; k <= cuts; ++k)
        if (i % cuts == 0 || j % cuts == 0 || k % cuts == 0)
          points.push_back(radius * (Vec3(i, j, k) - Vec3::Constant(0.5 * cuts)).normalized());
  return collision::buildHull(points);
}

/// A turn about an axis by 2 atan(half): no sine in it.
inline Quat turnBy(const Vec3& axis, double half) {
  Quat q(1, half * axis.x(), half * axis.y(), half * axis.z());
  const double length = std::sqrt(q.squaredNorm());
  q.coeffs() /= length;
  return q;
}

struct RigidScene {
  std::deque<collision::Hull> hulls;
  Dynamics dynamics;
  DynamicsStep settings;

  std::uint32_t addFree(const collision::Hull& hull, const Vec3& at,
                        const Quat& rotation = Quat::Identity(), double density = 500) {
    hulls.push_back(hull);
    const collision::Hull* part = &hulls.back();
    return add(freeSolid({&part, 1}, density, {rotation, at}));
  }
  std::uint32_t addStill(const collision::Hull& hull, const Vec3& at,
                         const Quat& rotation = Quat::Identity()) {
    hulls.push_back(hull);
    const collision::Hull* part = &hulls.back();
    return add(heldSolid({&part, 1}, {rotation, at}));
  }
  /// Its top is at height 0.
  std::uint32_t addFloor() { return addStill(boxHull({20, 0.5, 20}), {0, -0.5, 0}); }

  std::uint32_t add(Solid solid) {
    dynamics.solids.push_back(std::move(solid));
    return static_cast<std::uint32_t>(dynamics.solids.size() - 1);
  }
  /// All pairs of parts of which one is free.
  void pairAll() {
    std::vector<PartPairKey> keys;
    const auto& solids = dynamics.solids;
    const auto partsOf = [](const Solid& s) {
      return static_cast<std::uint32_t>(s.parts.size() + (s.mesh ? s.mesh->triangles().size() : 0));
    };
    for (std::uint32_t a = 0; a < solids.size(); ++a)
      for (std::uint32_t b = a + 1; b < solids.size(); ++b)
        for (std::uint32_t p = 0; p < partsOf(solids[a]); ++p)
          for (std::uint32_t q = 0; q < partsOf(solids[b]); ++q)
            if (solids[a].isFree() || solids[b].isFree()) keys.push_back({a, b, p, q});
    setPairs(dynamics, keys);
  }
  DynamicsReport run(int steps) {
    DynamicsReport report;
    for (int i = 0; i < steps; ++i) report = step(dynamics, settings);
    return report;
  }
  RigidBody& body(std::uint32_t solid) { return dynamics.solids[solid].motion; }
  bool asleep(std::uint32_t solid) const { return dynamics.solids[solid].asleep; }

  /// J, of all free bodies; potential energy above height 0.
  double energy() const {
    double sum = 0;
    for (const Solid& solid : dynamics.solids)
      if (solid.isFree())
        sum += kineticEnergy(solid.motion) -
               settings.solver.gravity.dot(solid.motion.centre) / solid.motion.inverseMass;
    return sum;
  }
  /// Whether any two parts that were paired penetrate now.
  bool anyPenetrates() const {
    for (const NearPair& pair : dynamics.pairs) {
      collision::FeatureCache cache;
      const auto a = partOf(dynamics.solids[pair.key.a], pair.key.partA);
      const auto b = partOf(dynamics.solids[pair.key.b], pair.key.partB);
      if (collision::decide(a, b, cache).verdict == collision::Verdict::penetrating) return true;
    }
    return false;
  }
};

}  // namespace enfilade::scene
