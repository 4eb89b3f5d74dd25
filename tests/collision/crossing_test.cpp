// Thin bodies that pass through each other at a time that is no double. The contact is proved, and
// its interval contains the exact time, in rational arithmetic.
#include "collision/motion/crossing.hpp"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>

#include "collision/motion/time_of_impact.hpp"
#include "tests/collision/random_shapes.hpp"
#include "tests/support/exact_crossing.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

const std::vector<Vec3> kPoint{{0, 0, 0}};
const std::vector<Vec3> kTriangle{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};

MotionResult findImpact(const MovingBody& a, const MovingBody& b, double horizon) {
  FeatureCache cache;
  return computeTimeOfImpact(a, b, horizon, cache);
}

void expectContactAtExactly(const MotionResult& impact, const mpq_class& time) {
  ASSERT_EQ(impact.outcome, MotionOutcome::contact);
  EXPECT_LE(mpq_class(impact.lo), time);
  EXPECT_GE(mpq_class(impact.hi), time);
  EXPECT_LE(impact.hi - impact.lo, 1e-12 * (1 + impact.hi));
}

TEST(Crossing, APointPassesThroughATriangle) {
  for (const double speed : {1.0 / 3, 0.7, 12.3, 900.1}) {
    const MovingBody a{{kPoint, {0.3, 0.2, -1}}, translate({0, 0, speed})};
    const MotionResult impact = findImpact(a, {{kTriangle}, {}}, 10);
    expectContactAtExactly(impact, 1 / mpq_class(speed));
    EXPECT_LE(impact.queries, 8u);
  }
}

TEST(Crossing, AnEdgePassesThroughAnEdge) {
  const std::vector<Vec3> alongX{{-1, 0, 0}, {1, 0, 0}}, alongY{{0.1, -1, 0}, {0.3, 1, 0}};
  for (const double speed : {1.0 / 3, 0.7, 12.3}) {
    const MovingBody a{{alongX, {0, 0.1, -1}}, translate({0.01, 0.02, speed})};
    expectContactAtExactly(findImpact(a, {{alongY}, {}}, 10), 1 / mpq_class(speed));
  }
}

TEST(Crossing, FarFromTheOriginAPointPassesThroughATriangle) {
  const Vec3 far{1e6, -3e5, 7e5};
  const MovingBody a{{kPoint, far + Vec3(0.3, 0.2, -1)}, translate({0, 0, 1.0 / 3})};
  const MovingBody b{{kTriangle, far}, {}};
  expectContactAtExactly(findImpact(a, b, 10), *findFirstTime(a, b));
}

TEST(Crossing, OneUlpOutsideTheTriangleIsNoContact) {
  struct Case {
    double x, y;
  };
  for (const auto& [x, y] :
       {Case{0.3, -0x1p-1074}, Case{0.3, -0x1p-56}, Case{-0x1p-60, 0.4},
        Case{0.5, std::nextafter(0.5, 1.0)}, Case{0.3, std::nextafter(0.7, 1.0)},
        Case{std::nextafter(1.0, 2.0), 0}, Case{-0x1p-70, -0x1p-70}}) {
    for (const double speed : {1.0 / 3, 0.7, 12.3}) {
      const MovingBody a{{kPoint, {x, y, -1}}, translate({0, 0, speed})};
      EXPECT_EQ(findImpact(a, {{kTriangle}, {}}, 10).outcome, MotionOutcome::clear)
          << x << ' ' << y;
    }
  }
}

TEST(Crossing, EdgesThatMissByOneUlpAreNoContact) {
  const std::vector<Vec3> alongX{{-1, 0, 0}, {1, 0, 0}}, alongY{{0, 0x1p-56, 0}, {0, 1, 0}};
  const MovingBody a{{alongX, {0, 0, -1}}, translate({0, 0, 1.0 / 3})};
  EXPECT_EQ(findImpact(a, {{alongY}, {}}, 10).outcome, MotionOutcome::clear);
}

TEST(Crossing, ThinBodiesMeetAtTheExactTime) {
  Random random(31);
  const std::array<std::array<int, 2>, 5> sizes{{{3, 3}, {3, 1}, {1, 3}, {3, 2}, {2, 2}}};
  int contacts = 0, misses = 0;
  std::array<std::vector<Vec3>, 2> points;
  for (int i = 0; i < 2000; ++i) {
    MovingBody a, b;
    const auto& [sizeA, sizeB] = sizes[static_cast<std::size_t>(i) % sizes.size()];
    makeThinPair(random, sizeA, sizeB, points, a, b);
    const auto time = findFirstTime(a, b);
    const MotionResult impact = findImpact(a, b, 3);
    const bool meets = time && *time <= 3;
    ++(meets ? contacts : misses);
    if (meets)
      expectContactAtExactly(impact, *time);
    else
      EXPECT_EQ(impact.outcome, MotionOutcome::clear) << i;
  }
  EXPECT_GT(contacts, 300);
  EXPECT_GT(misses, 400);
}

/// The query takes an interval around the exact time. A shift of the path by a multiple of an ulp
/// makes hits and near misses of the same triangle.
TEST(Crossing, NearAnEdgeNoMissIsAContact) {
  Random random(32);
  int proved = 0, hits = 0, misses = 0;
  for (int i = 0; i < 3000; ++i) {
    const std::vector<Vec3> triangle = makeRandomPoints(random, 3, 1);
    const double share = drawUniform(random, 0, 1);
    const Vec3 onEdge = share * triangle[0] + (1 - share) * triangle[1];
    const Vec3 velocity = makeRandomPoint(random, 1);
    const MovingBody a{{kPoint, onEdge - 1.1 * velocity}, translate(velocity)};
    const MovingBody b{{triangle}, {}};
    const bool hit = findFirstTime(a, b).has_value();
    ++(hit ? hits : misses);
    const bool isProved = isCrossingProved(a, b, 1, 1.2, {});
    proved += isProved;
    EXPECT_TRUE(hit || !isProved) << i;
  }
  EXPECT_GT(hits, 300);
  EXPECT_GT(misses, 300);
  EXPECT_GT(proved, hits / 2);
}

TEST(Crossing, AHitOfAnEdgeOrOfAVertexOfATriangleIsProved) {
  struct Case {
    double x, y;
  };
  for (const auto& [x, y] : {Case{0.5, 0.5}, Case{0.25, 0}, Case{0, 0}, Case{0, 1}}) {
    const MovingBody a{{kPoint, {x, y, -1}}, translate({0, 0, 0.3})};
    expectContactAtExactly(findImpact(a, {{kTriangle}, {}}, 10), 1 / mpq_class(0.3));
  }
}

TEST(Crossing, ThinBodiesOnALatticeMeetAtTheExactTime) {
  Random random(34);
  int contacts = 0, aligned = 0;
  for (int i = 0; i < 3000; ++i) {
    const std::vector<Vec3> pointsA = makeLatticePoints(random, 1 + i % 3, 2);
    const std::vector<Vec3> pointsB = makeLatticePoints(random, 3, 2);
    const Vec3 direction = makeLatticePoints(random, 1, 2)[0];
    const MovingBody a{{pointsA, -6 * direction}, translate(0.3 * direction)};
    const MovingBody b{{pointsB}, {}};
    FeatureCache cache;
    if (computeSeparation(a.body, b.body, cache).verdict != Verdict::separated) continue;
    const auto time = findFirstTime(a, b);
    const MotionResult impact = findImpact(a, b, 100);
    if (!time) {  // none, or a contact within one plane
      if (impact.outcome != MotionOutcome::contact) continue;
      const PairAtTime pair(a, b, impact.hi);
      EXPECT_NE(computeSeparation(pair.a(), pair.b(), cache).verdict, Verdict::separated) << i;
      continue;
    }
    ASSERT_EQ(impact.outcome, MotionOutcome::contact) << i;
    ++contacts;
    EXPECT_LE(mpq_class(impact.lo), *time) << i;
    EXPECT_LE(impact.hi - impact.lo, 1e-12 * (1 + impact.hi)) << i;
    aligned += mpq_class(impact.hi) < *time;  // an earlier contact within one plane
  }
  EXPECT_GT(contacts, 300);
  EXPECT_LT(aligned, contacts / 10);
}

TEST(Crossing, ADoorWithoutThicknessMeetsAPoint) {
  const std::vector<Vec3> door{{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {0, 2, 0}};
  for (const double radius : {0.05, 0.3, 0.99}) {
    const double angle = 1;  // the door rotates from +X towards -Z
    const MovingBody a{{door}, {Vec3::Zero(), Vec3::Zero(), {0, 0.25, 0}}};
    const MovingBody b{{kPoint, {radius * std::cos(angle), 0.7, -radius * std::sin(angle)}}, {}};
    const MotionResult impact = findImpact(a, b, 64);
    ASSERT_EQ(impact.outcome, MotionOutcome::contact) << radius;
    EXPECT_NEAR(impact.lo, 4 * angle, 1e-13 / radius);
    EXPECT_LE(impact.hi - impact.lo, 1e-12 * (1 + impact.hi));
  }
  const MovingBody a{{door}, {Vec3::Zero(), Vec3::Zero(), {0, 0.25, 0}}};
  const double past = 1 + 1e-13;
  const MovingBody b{{kPoint, {past * std::cos(1), 0.7, -past * std::sin(1)}}, {}};
  EXPECT_NE(findImpact(a, b, 12).outcome, MotionOutcome::contact);
}

TEST(Crossing, AFallingPointPassesThroughATriangle) {
  const std::vector<Vec3> floor{{-1, 0, -1}, {2, 0, -1}, {0, 0, 2}};
  const MovingBody a{{kPoint, {0.1, 3, 0.2}}, {{0.01, 0, 0}, {0, -9.81, 0}, Vec3::Zero()}};
  const MotionResult impact = findImpact(a, {{floor}, {}}, 10);
  ASSERT_EQ(impact.outcome, MotionOutcome::contact);
  EXPECT_NEAR(impact.hi, std::sqrt(6 / 9.81), 1e-12);
  EXPECT_LE(impact.hi - impact.lo, 1e-12 * (1 + impact.hi));
}

/// Distance at `time`, with poses by libm.
double computeDistanceAt(const MovingBody& a, const MovingBody& b, double time) {
  const PairAtTime pair(a, b, time);
  FeatureCache cache;
  return computeSeparation(pair.a(), pair.b(), cache).distance;
}

TEST(Crossing, TumblingTrianglesMeetWhereTheirDistanceVanishes) {
  Random random(33);
  int contacts = 0, unproved = 0;
  std::array<std::vector<Vec3>, 2> points;
  for (int i = 0; i < 400; ++i) {
    MovingBody a, b;
    makeThinPair(random, 3, 3, points, a, b);
    a.motion.angularVelocity = makeRandomPoint(random, 3);
    b.motion.angularVelocity = makeRandomPoint(random, 3);
    a.motion.acceleration = makeRandomPoint(random, 0.3);
    const MotionResult impact = findImpact(a, b, 3);
    unproved += impact.outcome == MotionOutcome::unproved;
    if (impact.outcome != MotionOutcome::contact) continue;
    ++contacts;
    EXPECT_LE(impact.hi - impact.lo, 1e-12 * (1 + impact.hi)) << i;
    EXPECT_LT(computeDistanceAt(a, b, impact.lo), 1e-10) << i;
  }
  EXPECT_GT(contacts, 80);
  EXPECT_EQ(unproved, 0);
}

}  // namespace
}  // namespace enfilade::collision
