// Polytopes that turn past one another, asked warm at each step: what decide() and
// penetrationDepth() promise of their numbers, held against refine().
#include <gtest/gtest.h>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

Vec3 direction(Random& random) {
  return randomPoint(random, 1).normalized();
}

Hull roundHull(Random& random, int count) {
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) points.push_back(direction(random));
  return buildHull(points);
}

/// A and B turn by a degree or two a step; B is kept at about `gap` metres from A's surface.
struct Motion {
  Hull hullA, hullB;
  Vec3 axisA, axisB, away;
  double gap;
  Mat3 turnA, turnB;
  Vec3 at;

  Motion(Random& random, int vertices, double apart)
      : hullA(roundHull(random, vertices)),
        hullB(roundHull(random, vertices)),
        axisA(direction(random)),
        axisB(direction(random)),
        away(direction(random)),
        gap(apart) {}
  void step(int k) {
    turnA = Eigen::AngleAxisd(0.02 * k, axisA).toRotationMatrix();
    turnB = Eigen::AngleAxisd(0.03 * k, axisB).toRotationMatrix();
    at = 10 * (Eigen::AngleAxisd(0.02 * k, axisA) * away);
    FeatureCache none;
    const Decision far = decide(a(), b(), none);
    at -= (far.distance - gap) * far.normal;
  }
  ConvexBody a() const { return {hullA.vertices, Vec3(0.25, 0.5, 0.125), &turnA, &hullA}; }
  ConvexBody b() const { return {hullB.vertices, Vec3(0.25, 0.5, 0.125) + at, &turnB, &hullB}; }
  /// The largest |coordinate| of both bodies from A's translation.
  double largest() const {
    double most = 0;
    for (const Vec3& p : hullA.vertices) most = std::max(most, (turnA * p).cwiseAbs().maxCoeff());
    for (const Vec3& p : hullB.vertices)
      most = std::max(most, (turnB * p + at).cwiseAbs().maxCoeff());
    return most;
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
        const Decision d = decide(motion.a(), motion.b(), cache);
        const Refinement exact = refine(motion.a(), motion.b(), exactCache);
        ASSERT_EQ(d.verdict, Verdict::separated);
        EXPECT_LE(std::abs(d.distance - exact.distance), d.errorBound + 2e-16 * exact.distance);
        EXPECT_LE(d.errorBound, 16 * 0x1p-53 * motion.largest());
        EXPECT_NEAR((d.pointB - d.pointA).norm(), d.distance, 1e-15 * motion.largest());
        EXPECT_NEAR(d.normal.dot(d.pointB - d.pointA), d.distance, 1e-15 * motion.largest());
        EXPECT_NEAR(cache.axis.norm(), 1, 1e-15);
        changes += cache.pairs != last.pairs || cache.size != last.size;
        byFilter += d.decidedBy == DecidedBy::filter;
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
        const Decision d = decide(motion.a(), motion.b(), cache);
        if (d.verdict != Verdict::penetrating) continue;  // two corners slipped past each other
        ++count;
        EXPECT_LE((d.pointB - d.pointA).norm(), 4 * 0x1p-53 * motion.largest());
        const Depth told = penetrationDepth(motion.a(), motion.b(), cache, depthCache);
        EXPECT_TRUE(told.global);
        EXPECT_LE(told.errorBound, 1e-12 * told.depth + 0x1p-53 * motion.largest());
        if (k % 8 != 0 || vertices > 8) continue;  // an exact depth costs much
        FeatureCache exactCache;
        const Refinement exact = refine(motion.a(), motion.b(), exactCache);
        EXPECT_LE(std::abs(told.depth - exact.penetration),
                  told.errorBound + 2e-16 * exact.penetration);
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
    const Decision d = decide(motion.a(), motion.b(), none);
    EXPECT_FALSE(
        decideWithin(motion.a(), motion.b(), d.distance - 3 * d.errorBound - 1e-15, cache));
    EXPECT_TRUE(decideWithin(motion.a(), motion.b(), d.distance + 3 * d.errorBound, cache));
  }
}

}  // namespace
}  // namespace enfilade::collision
