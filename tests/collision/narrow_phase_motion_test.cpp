// Polytopes that rotate past each other, queried with a warm start at each step. Compares the error
// bounds of computeSeparation() and computePenetrationDepth() with refineSeparation().
#include <gtest/gtest.h>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

Vec3 drawDirection(Random& random) {
  return makeRandomPoint(random, 1).normalized();
}

Hull makeRoundHull(Random& random, int count) {
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) points.push_back(drawDirection(random));
  return buildHull(points);
}

/// A and B rotate by a degree or two per step; B stays at about `distance` metres from A's surface.
struct Motion {
  Hull hullA, hullB;
  Vec3 axisA, axisB, away;
  double distance;
  Mat3 rotationA, rotationB;
  Vec3 translationB;

  Motion(Random& random, int vertices, double initialDistance)
      : hullA(makeRoundHull(random, vertices)),
        hullB(makeRoundHull(random, vertices)),
        axisA(drawDirection(random)),
        axisB(drawDirection(random)),
        away(drawDirection(random)),
        distance(initialDistance) {}
  void step(int k) {
    rotationA = Eigen::AngleAxisd(0.02 * k, axisA).toRotationMatrix();
    rotationB = Eigen::AngleAxisd(0.03 * k, axisB).toRotationMatrix();
    translationB = 10 * (Eigen::AngleAxisd(0.02 * k, axisA) * away);
    FeatureCache none;
    const SeparationResult far = computeSeparation(a(), b(), none);
    translationB -= (far.distance - distance) * far.normal;
  }
  PlacedConvex a() const { return {hullA.vertices, Vec3(0.25, 0.5, 0.125), &rotationA, &hullA}; }
  PlacedConvex b() const {
    return {hullB.vertices, Vec3(0.25, 0.5, 0.125) + translationB, &rotationB, &hullB};
  }
  /// The largest |coordinate| of both bodies from A's translation.
  double findMaxCoordinate() const {
    double result = 0;
    for (const Vec3& p : hullA.vertices)
      result = std::max(result, (rotationA * p).cwiseAbs().maxCoeff());
    for (const Vec3& p : hullB.vertices)
      result = std::max(result, (rotationB * p + translationB).cwiseAbs().maxCoeff());
    return result;
  }
};

TEST(NarrowPhaseMotion, ExactDistancesLieWithinBoundsOfAFewUnitsOfRounding) {
  Random random(1);
  int changes = 0, byFilter = 0, count = 0;
  for (const int vertices : {8, 60}) {
    for (const double gap : {1.0, 1e-3, 1e-9}) {
      Motion motion(random, vertices, gap);
      FeatureCache cache, exactCache;
      for (int k = 0; k < 60; ++k) {
        motion.step(k);
        const FeatureCache last = cache;
        const SeparationResult d = computeSeparation(motion.a(), motion.b(), cache);
        const RefinedSeparation exact = refineSeparation(motion.a(), motion.b(), exactCache);
        ASSERT_EQ(d.verdict, Verdict::separated);
        EXPECT_LE(std::abs(d.distance - exact.distance), d.errorBound + 2e-16 * exact.distance);
        EXPECT_LE(d.errorBound, 16 * 0x1p-53 * motion.findMaxCoordinate());
        EXPECT_NEAR((d.pointB - d.pointA).norm(), d.distance, 1e-15 * motion.findMaxCoordinate());
        EXPECT_NEAR(d.normal.dot(d.pointB - d.pointA), d.distance,
                    1e-15 * motion.findMaxCoordinate());
        EXPECT_NEAR(cache.axis.norm(), 1, 1e-15);
        changes += cache.pairs != last.pairs || cache.size != last.size;
        byFilter += d.certificate == Certificate::filter;
        ++count;
      }
    }
  }
  EXPECT_GT(changes, 30);
  EXPECT_GT(byFilter, count * 9 / 10);
}

TEST(NarrowPhaseMotion, PenetratingBodiesHaveACommonPointAndADepthWithinItsBound) {
  Random random(2);
  int count = 0;
  for (const int vertices : {8, 30}) {
    for (const double depth : {0.3, 0.1, 1e-6}) {
      Motion motion(random, vertices, -depth);
      FeatureCache cache;
      DepthCache depthCache;
      for (int k = 0; k < 40; ++k) {
        motion.step(k);
        const SeparationResult d = computeSeparation(motion.a(), motion.b(), cache);
        if (d.verdict != Verdict::penetrating) continue;  // two corners slipped past each other
        ++count;
        EXPECT_LE((d.pointB - d.pointA).norm(), 4 * 0x1p-53 * motion.findMaxCoordinate());
        const PenetrationResult reported =
            computePenetrationDepth(motion.a(), motion.b(), cache, depthCache);
        EXPECT_TRUE(reported.global);
        EXPECT_LE(reported.errorBound,
                  1e-12 * reported.depth + 0x1p-53 * motion.findMaxCoordinate());
        if (k % 8 != 0 || vertices > 8) continue;  // an exact depth is expensive
        FeatureCache exactCache;
        const RefinedSeparation exact = refineSeparation(motion.a(), motion.b(), exactCache);
        EXPECT_LE(std::abs(reported.depth - exact.penetration),
                  reported.errorBound + 2e-16 * exact.penetration);
      }
    }
  }
  EXPECT_GT(count, 100);
}

TEST(NarrowPhaseMotion, ALimitIsProvedWhereverTheDistanceIsGreaterByMoreThanItsBound) {
  Random random(3);
  Motion motion(random, 40, 0.5);
  FeatureCache cache;
  for (int k = 0; k < 60; ++k) {
    motion.step(k);
    FeatureCache none;
    const SeparationResult d = computeSeparation(motion.a(), motion.b(), none);
    EXPECT_FALSE(computeSeparationWithin(motion.a(), motion.b(),
                                         d.distance - 3 * d.errorBound - 1e-15, cache));
    EXPECT_TRUE(
        computeSeparationWithin(motion.a(), motion.b(), d.distance + 3 * d.errorBound, cache));
  }
}

}  // namespace
}  // namespace enfilade::collision
