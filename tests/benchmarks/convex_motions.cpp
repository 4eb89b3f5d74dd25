#include "tests/benchmarks/convex_motions.hpp"

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/random.hpp"

namespace enfilade::benchmarks {
namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295;
constexpr double kFarApart = 10;  // metres: separated for certain, for unit spheres

Points makeSphericalPoints(Random& random, std::size_t count) {
  Points points;
  for (std::size_t k = 0; k < count; ++k) points.push_back(drawDirection(random));
  return points;
}

/// A steady rotation about one axis.
struct Turning {
  Vec3 axis;
  double start, step;  ///< radians

  explicit Turning(Random& random) : axis(drawDirection(random)) {
    start = drawUniform(random, 0, 6.28);
    step = drawUniform(random, 0.6, 1.8) * kRadiansPerDegree;
  }
  Mat3 computeRotationAt(std::size_t k) const {
    return Eigen::AngleAxisd(start + step * static_cast<double>(k), axis).toRotationMatrix();
  }
};

double getGapLength(Gap gap) {
  if (gap == Gap::separated) return 1;
  return gap == Gap::near ? 1e-3 : -0.1;
}

ConvexMotion makeMotion(Random& random, std::size_t vertices, Gap gap, std::size_t steps) {
  ConvexMotion motion{
      makeSphericalPoints(random, vertices), makeSphericalPoints(random, vertices), {}, {}};
  const collision::Hull hullA = collision::buildHull(motion.a);
  const collision::Hull hullB = collision::buildHull(motion.b);
  const Turning turnA(random), turnB(random), orbit(random);
  const Vec3 away = orbit.axis.unitOrthogonal();
  for (std::size_t k = 0; k < steps; ++k) {
    RigidTransform a{turnA.computeRotationAt(k), Vec3(0.25, 0.5, 0.125)};
    RigidTransform b{turnB.computeRotationAt(k),
                     a.translation + kFarApart * (orbit.computeRotationAt(k) * away)};
    collision::FeatureCache none;
    const auto separation =
        collision::computeSeparation({hullA.vertices, a.translation, &a.rotation, &hullA},
                                     {hullB.vertices, b.translation, &b.rotation, &hullB}, none);
    b.translation -= (separation.distance - getGapLength(gap)) * separation.normal;
    motion.placesA.push_back(a);
    motion.placesB.push_back(b);
  }
  return motion;
}

}  // namespace

const char* getName(Gap gap) {
  if (gap == Gap::separated) return "separated";
  return gap == Gap::near ? "near" : "penetrating";
}

std::vector<ConvexMotion> makeConvexMotions(std::size_t vertices, Gap gap, std::size_t pairs,
                                            std::size_t steps) {
  Random random(vertices);
  std::vector<ConvexMotion> motions;
  for (std::size_t k = 0; k < pairs; ++k) {
    motions.push_back(makeMotion(random, vertices, gap, steps));
  }
  return motions;
}

}  // namespace enfilade::benchmarks
