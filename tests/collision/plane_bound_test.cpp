// Steps that a separating plane certifies, and the casts of uniform motions that take these steps:
// sampled distances show that nothing comes closer.
#include "collision/motion/plane_bound.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "collision/motion/rigid_motion.hpp"
#include "collision/motion/shape_cast.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

/// A body at one time of its motion, which RotatingBody views.
struct Posed {
  std::vector<Vec3> vertices;
  RigidTransform pose;
  Vec3 reference = Vec3::Zero(), angularVelocity = Vec3::Zero();

  PlacedConvex getPlaced() const { return place({vertices}, pose); }
  RotatingBody makeView() const {
    const Vec3 point = pose.translation + reference;
    double radius = 0;
    for (const Vec3& v : vertices)
      radius = std::max(radius, (placeVertex(getPlaced(), v) - point).norm());
    return {getPlaced(), reference, angularVelocity, radius * (1 + 1e-12)};
  }
  /// After `time`, with the reference point moved by `displacement`.
  Posed computeLater(double time, const Vec3& displacement) const {
    Posed later = *this;
    const double angle = angularVelocity.norm() * time;
    if (angle > 0) {
      const Mat3 turn = Eigen::AngleAxisd(angle, angularVelocity.normalized()).toRotationMatrix();
      later.pose.rotation = turn * pose.rotation;
      later.reference = turn * reference;
    }
    later.pose.translation = pose.translation + reference + displacement - later.reference;
    return later;
  }
};

/// Two bodies in constant acceleration. B's reference point moves; A's stands still.
struct Pair {
  Posed a, b;
  Vec3 velocity = Vec3::Zero(), acceleration = Vec3::Zero();
  double keptDistance = 0;

  Pair computeLater(double time) const {
    Pair later = *this;
    later.a = a.computeLater(time, Vec3::Zero());
    later.b = b.computeLater(time, time * velocity + 0.5 * time * time * acceleration);
    later.velocity = velocity + time * acceleration;
    return later;
  }
  SeparationResult findSeparation(FeatureCache& cache) const {
    return computeSeparation(a.getPlaced(), b.getPlaced(), cache);
  }
  double step(const SeparationResult& from, const FeatureCache& cache, double cap) const {
    const Vec3 offset = b.pose.translation + b.reference - a.pose.translation - a.reference;
    const PairMotion motion{a.makeView(), b.makeView(), offset,
                            velocity,     acceleration, keptDistance};
    return computeCertifiedStep(motion, {from.normal, from.distance - from.errorBound}, cache, cap);
  }
};

enum class Kind { bothRotate, onlyARotates, stillAboutAsReference, translation, accelerated };

Mat3 makeRotation(Random& random) {
  const double angle = drawUniform(random, 0, 3);
  return Eigen::AngleAxisd(angle, makeRandomPoint(random, 1).normalized()).toRotationMatrix();
}

Posed makePosed(Random& random, int vertices) {
  const Mat3 rotation = makeRotation(random);
  return {makeRandomPoints(random, vertices, 0.5), {rotation, makeRandomPoint(random, 0.9)}};
}

Pair makePair(Random& random, Kind kind) {
  Pair pair{makePosed(random, 8), makePosed(random, 3)};  // a triangle has no thickness
  // Positive: a step may lead to this distance up to rounding, and at 0 the poses then overlap.
  pair.keptDistance = random() % 2 ? drawUniform(random, 0, 0.05) : 1e-6;
  pair.velocity = makeRandomPoint(random, 1);
  if (kind == Kind::accelerated) pair.acceleration = makeRandomPoint(random, 2);
  if (kind == Kind::translation) return pair;
  pair.a.angularVelocity = makeRandomPoint(random, 3);
  if (random() % 2) pair.a.reference = makeRandomPoint(random, 1);
  if (kind == Kind::bothRotate || kind == Kind::accelerated)
    pair.b.angularVelocity = random() % 4 ? makeRandomPoint(random, 3) : pair.a.angularVelocity;
  if (kind == Kind::stillAboutAsReference) {
    pair.velocity.setZero();
    pair.b.reference = pair.a.pose.translation + pair.a.reference - pair.b.pose.translation;
  }
  return pair;
}

TEST(PlaneBound, NothingComesCloserThanTheKeptDistanceWithinAStep) {
  Random random(11);
  constexpr double kCap = 1;
  for (const Kind kind : {Kind::bothRotate, Kind::onlyARotates, Kind::stillAboutAsReference,
                          Kind::translation, Kind::accelerated}) {
    int tried = 0, free = 0, arrived = 0;
    for (int k = 0; k < 1000; ++k) {
      Pair at = makePair(random, kind);
      FeatureCache cache;
      SeparationResult start = at.findSeparation(cache);
      if (start.verdict != Verdict::separated || start.distance < at.keptDistance + 0.02) continue;
      ++tried;
      // Steps one after another: to the end, or to the kept distance.
      double time = 0;
      for (int i = 0; i < 40; ++i) {
        const double step = at.step(start, cache, kCap - time);
        for (int sample = 1; sample <= 24; ++sample) {
          FeatureCache other;
          const SeparationResult there = at.computeLater(step * sample / 24).findSeparation(other);
          ASSERT_EQ(there.verdict, Verdict::separated) << k << " step " << i;
          ASSERT_GT(there.distance, at.keptDistance - 1e-9) << k << " step " << i;
        }
        at = at.computeLater(step);
        time += step;
        start = at.findSeparation(cache);
        if (time >= kCap || start.distance - at.keptDistance < 1e-6) break;
      }
      free += time >= kCap;
      arrived += time < kCap && start.distance - at.keptDistance < 1e-6;
    }
    EXPECT_GT(tried, 400);
    EXPECT_GT(free, tried / 10) << static_cast<int>(kind);
    EXPECT_GT(arrived, tried / 20) << static_cast<int>(kind);
    EXPECT_GT(free + arrived, tried * 98 / 100)
        << "steps become too short: " << static_cast<int>(kind);
  }
}

ScrewMotion makeScrew(Random& random, const Vec3& position) {
  return {makeRotation(random), position, makeRandomPoint(random, 0.8),
          makeRandomPoint(random, 1).normalized(), drawUniform(random, 0, 2)};
}

double computeDistanceAt(const std::vector<Vec3>& a, const ScrewMotion& motionA,
                         const std::vector<Vec3>& b, const ScrewMotion& motionB, double fraction) {
  const RigidTransform poseA = computeTransformAfter(motionA, fraction),
                       poseB = computeTransformAfter(motionB, fraction);
  FeatureCache cache;
  const SeparationResult there = computeSeparation(place({a}, poseA), place({b}, poseB), cache);
  return there.verdict == Verdict::separated ? there.distance : -1;
}

TEST(PlaneBound, CastsOfUniformMotionsStopBeforeWhatTheyMeetAndNeverLate) {
  constexpr ContactOffset kOffset{0.875e-3, 1.03125e-3};
  Random random(12);
  int tried = 0, stopped = 0;
  for (int k = 0; k < 800; ++k) {
    const std::vector<Vec3> a = makeRandomPoints(random, 8, 0.5),
                            b = makeRandomPoints(random, 3, 0.5);
    const ScrewMotion motionA = makeScrew(random, Vec3::Zero());
    ScrewMotion motionB = makeScrew(random, makeRandomPoint(random, 1));
    const bool isStill = k % 2 == 0;
    if (isStill) motionB.translation.setZero(), motionB.angle = 0;
    if (!(computeDistanceAt(a, motionA, b, motionB, 0) > kOffset.rest)) continue;
    ++tried;
    FeatureCache cache;
    const MovingShape movingA{{a}, motionA};
    const RigidTransform poseB = computeTransformAfter(motionB, 0);
    const MotionResult cast = isStill
                                  ? castShape(movingA, place({b}, poseB), kOffset, cache)
                                  : castShape(movingA, MovingShape{{b}, motionB}, kOffset, cache);
    for (int i = 0; i <= 100; ++i)
      ASSERT_GT(computeDistanceAt(a, motionA, b, motionB, cast.lo * i / 100),
                kOffset.min * (1 - 1e-9))
          << k << " at " << i;
    if (isStill) {
      FeatureCache other;
      const MotionResult asMoving = castShape(movingA, MovingShape{{b}, motionB}, kOffset, other);
      EXPECT_EQ(asMoving.isClear(), cast.isClear()) << k;
      EXPECT_NEAR(asMoving.lo, cast.lo, 0.01) << k;
    }
    if (cast.isClear()) continue;
    ++stopped;
    EXPECT_LT(computeDistanceAt(a, motionA, b, motionB, cast.lo), kOffset.rest * 1.01) << k;
  }
  EXPECT_GT(tried, 150);
  EXPECT_GT(stopped, tried / 12);
  EXPECT_LT(stopped, tried * 9 / 10);
}

}  // namespace
}  // namespace enfilade::collision
