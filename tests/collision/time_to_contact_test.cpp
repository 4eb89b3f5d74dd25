#include "collision/motion/time_to_contact.hpp"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "collision/motion/time_of_impact.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The bound of Lin 1993, section 5.1; `speed` is the closing speed of the closest points.
double computeReferenceTime(double distance, double speed, double acceleration) {
  if (acceleration == 0) return distance / speed;
  return (std::sqrt(speed * speed + 2 * acceleration * distance) - speed) / acceleration;
}

/// A power of ten between 10^-maxExponent and 10^maxExponent.
double drawMagnitude(Random& random, double maxExponent) {
  const double exponent = drawUniform(random, -maxExponent, maxExponent);
  return std::pow(10.0, exponent);
}

/// The exact decrease of the distance in `time`.
mpq_class computeClosedDistance(const ClosingBounds& closing, const mpq_class& time) {
  return closing.speed * time + mpq_class(closing.acceleration) * time * time / 2;
}

TEST(TimeToContact, IsNeverAboveTheTruthAndHardlyBelow) {
  Random random(11);
  for (int i = 0; i < 3000; ++i) {
    const double distance = drawMagnitude(random, 100);
    ClosingBounds closing{drawMagnitude(random, 100), drawMagnitude(random, 100)};
    if (i % 5 == 0) closing.speed = 0;
    if (i % 7 == 0) closing.acceleration = 0;
    const double time = computeTimeToContact(distance, closing);
    if (closing.speed == 0 && closing.acceleration == 0) {
      EXPECT_EQ(time, kInfinity);
      continue;
    }
    EXPECT_LE(computeClosedDistance(closing, mpq_class(time)), mpq_class(distance)) << i;
    const mpq_class later = mpq_class(time) * (1 + mpq_class(0x1p-48));
    EXPECT_GE(computeClosedDistance(closing, later), mpq_class(distance)) << i;
  }
}

TEST(TimeToContact, HoldsWhereProductsUnderflowOrOverflow) {
  for (const double distance : {0x1p-1060, 0x1p-600, 1.0, 0x1p600, 0x1p1000}) {
    for (const double speed : {0.0, 0x1p-1070, 0x1p-700, 1.0, 0x1p700}) {
      for (const double acceleration : {0.0, 0x1p-1070, 0x1p-700, 1.0, 0x1p700}) {
        const double time = computeTimeToContact(distance, {speed, acceleration});
        if (time == kInfinity) {
          EXPECT_TRUE(speed == 0 && acceleration == 0);
          continue;
        }
        EXPECT_LE(computeClosedDistance({speed, acceleration}, mpq_class(time)),
                  mpq_class(distance));
      }
    }
  }
}

TEST(TimeToContact, WithoutAGapIsNowAndWithoutMotionNever) {
  EXPECT_EQ(computeTimeToContact(0, {1, 1}), 0);
  EXPECT_EQ(computeTimeToContact(-1, {1, 1}), 0);
  EXPECT_EQ(computeTimeToContact(1, {0, 0}), kInfinity);
  EXPECT_EQ(computeTimeToContact(std::nan(""), {1, 1}), 0);
  EXPECT_EQ(computeTimeToContact(1, {std::nan(""), 1}), 0);
}

//   o----------+----------o   a rod, parallel to the wall, rotates about its centre:
//   ~~~~~~~~~~~~~~~~~~~~~~~   the centre is as close as any point, and at rest
TEST(TimeToContact, ARodAlongAWallArrivesBeforeTheSeedsBoundAndAfterOurs) {
  constexpr double kHalfLength = 1, kHeight = 1e-4, kSpin = 2;
  const double arrival = std::asin(kHeight / kHalfLength) / kSpin;
  const double seed = computeReferenceTime(kHeight, 0, kSpin * kSpin * kHalfLength);
  EXPECT_GT(seed, 100 * arrival);
  const MotionBounds rod{Vec3::Zero(), 0, {0, 0, kSpin}, 0, kHalfLength};
  const double ours =
      computeTimeToContact(kHeight, computeClosingBounds(rod, {}, -Vec3::UnitY(), 1));
  EXPECT_LE(ours, arrival);
  EXPECT_GT(ours, 0.99 * arrival);
}

TEST(ClosingBounds, NoVertexClosesFasterThanTheBound) {
  Random random(12);
  double tightest = 0;
  for (int i = 0; i < 300; ++i) {
    const Vec3 n = makeRandomPoint(random, 1).normalized();
    const Vec3 velocity = makeRandomPoint(random, 2), pull = makeRandomPoint(random, 1);
    const Vec3 spin = makeRandomPoint(random, 3),
               twist = spin.normalized() * drawUniform(random, 0, 2);
    const Vec3 vertex = makeRandomPoint(random, 1);
    const MotionBounds a{velocity, pull.norm(), spin, twist.norm(), vertex.norm()};
    const double interval = 1.5;
    const ClosingBounds closing = computeClosingBounds(a, {}, n, interval);
    for (double t = 0; t <= interval; t += 0.03) {
      const double angle = spin.norm() * t + twist.norm() * t * t / 2;
      const Vec3 turned = Eigen::AngleAxisd(angle, spin.normalized()) * vertex;
      const double closed = n.dot(velocity * t + pull * t * t / 2 + turned - vertex);
      const double bound = closing.speed * t + closing.acceleration * t * t / 2;
      EXPECT_LE(closed, bound + 1e-14) << i << " at " << t;
      if (t > 0 && t < 0.1) tightest = std::max(tightest, closed / bound);
    }
  }
  EXPECT_GT(tightest, 0.6);  // the bound is tight
}

TEST(NextCheck, WaitsForTheContactOrForTheLeastTimeAndSaysWhetherThatIsProved) {
  const NextCheck far = scheduleCheck(1, {2, 0}, 1e-3, 5e-4);
  EXPECT_NEAR(far.after, 0.5, 1e-12);
  EXPECT_TRUE(far.proved);
  // 1e-3 s at 2 m/s closes 2 mm: more than 2 epsilon of 1 mm.
  const NextCheck soon = scheduleCheck(1e-4, {2, 0}, 1e-3, 5e-4);
  EXPECT_EQ(soon.after, 1e-3);
  EXPECT_FALSE(soon.proved);
  const NextCheck slow = scheduleCheck(1e-4, {0.5, 0}, 1e-3, 5e-4);
  EXPECT_EQ(slow.after, 1e-3);
  EXPECT_TRUE(slow.proved);
  EXPECT_FALSE(scheduleCheck(1e-4, {1, 0}, 1e-3, 5e-4).proved);  // exactly 2 epsilon: not less
}

const std::vector<Vec3> kCube{{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1},
                              {-1, -1, 1},  {1, -1, 1},  {-1, 1, 1},  {1, 1, 1}};

TEST(TimeOfImpact, IsProvedUpToTheContactAndNotBeyond) {
  MovingBody a{{kCube}, {{1, 0, 0}, Vec3::Zero(), Vec3::Zero()}};
  MovingBody b{{kCube, {5, 0, 0}}, {}};
  for (const double t : {1.0, 2.0, 2.9999999, 3 - 1e-11}) {
    FeatureCache cache;
    const MotionResult impact = computeTimeOfImpact(a, b, t, cache);
    EXPECT_TRUE(impact.isClear()) << t;
    EXPECT_EQ(impact.lo, t);
  }
  FeatureCache cache;
  const MotionResult beyond = computeTimeOfImpact(a, b, 3.1, cache);
  EXPECT_EQ(beyond.outcome, MotionOutcome::contact);
  EXPECT_NEAR(beyond.lo, 3, 1e-11);
  a.body.translation = {4, 0, 0};
  EXPECT_FALSE(computeTimeOfImpact(a, b, 1e-6, cache).isClear());
}

using PreciseMatrix = std::array<std::array<mpf_class, 3>, 3>;

PreciseMatrix toPreciseMatrix(const Mat3& from) {
  PreciseMatrix result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result[i][j] = mpf_class(from(i, j), 512);
  return result;
}

PreciseMatrix operator*(const PreciseMatrix& a, const PreciseMatrix& b) {
  PreciseMatrix result = toPreciseMatrix(Mat3::Zero());
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) result[i][j] += a[i][k] * b[k][j];
  return result;
}

/// The exponential of the cross product with angularVelocity * time: Taylor's series of its 2^-40th
/// part, squared 40 times.
PreciseMatrix computePreciseRotation(const Vec3& angularVelocity, double time) {
  constexpr int kHalvings = 40;
  Mat3 cross;
  cross << 0, -angularVelocity.z(), angularVelocity.y(), angularVelocity.z(), 0,
      -angularVelocity.x(), -angularVelocity.y(), angularVelocity.x(), 0;
  PreciseMatrix part = toPreciseMatrix(cross);
  for (auto& row : part)
    for (mpf_class& entry : row) {
      entry *= time;
      mpf_div_2exp(entry.get_mpf_t(), entry.get_mpf_t(), kHalvings);
    }
  PreciseMatrix sum = toPreciseMatrix(Mat3::Identity()), term = sum;
  for (int n = 1; n < 20; ++n) {
    term = term * part;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) term[i][j] /= n, sum[i][j] += term[i][j];
  }
  for (int i = 0; i < kHalvings; ++i) sum = sum * sum;
  return sum;
}

TEST(MovingPose, ATurnIsWithinItsBoundOfTheMatrixExponential) {
  Random random(13);
  double worst = 0;
  for (int i = 0; i < 300; ++i) {
    const Mat3 start =
        Eigen::AngleAxisd(drawUniform(random, 0, 6), makeRandomPoint(random, 1).normalized())
            .toRotationMatrix();
    const Vec3 spin = makeRandomPoint(random, 1) * drawMagnitude(random, 3);
    const double time = drawMagnitude(random, 1);
    const Mat3 ours = integrateRotation(start, spin, time);
    const PreciseMatrix truth = computePreciseRotation(spin, time) * toPreciseMatrix(start);
    Mat3 off;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) off(r, c) = mpf_class(truth[r][c] - ours(r, c)).get_d();
    const double error = computeRotationError(start, spin, time, 1);
    EXPECT_LE(off.norm(), error) << i;
    EXPECT_LT(error, 1e-15 * (1 + spin.norm() * time));
    worst = std::max(worst, off.norm() / error);
  }
  EXPECT_GT(worst, 0.2);
}

TEST(MovingPose, QuarterTurnsMoveAxesOntoAxes) {
  const double quarter = 1.5707963267948966;
  for (int k = 0; k < 9; ++k) {
    const Mat3 turn = integrateRotation(Mat3::Identity(), {0, 0, quarter}, k);
    const Vec3 x = turn * Vec3::UnitX();
    EXPECT_NEAR(x.x(), (k % 2 == 0 ? 1 - k % 4 : 0), 2e-15);
    EXPECT_NEAR(x.y(), (k % 2 == 0 ? 0 : 2 - k % 4), 2e-15);
    EXPECT_EQ(x.z(), 0);
  }
}

TEST(MovingPose, AMillionRadiansAreTooMany) {
  EXPECT_EQ(computeRotationError(Mat3::Identity(), {2e6, 0, 0}, 1, 1), kInfinity);
}

TEST(MovingPose, DisplacementIsExactWithinItsErrorBound) {
  Random random(14);
  int exact = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto number = [&] { return drawUniform(random, -1, 1) * drawMagnitude(random, 6); };
    const Difference place{number(), number()}, velocity{number(), number()};
    Difference pull{number(), number()};
    double time = std::abs(number());
    if (i % 2 == 0) pull = {0, 0}, time = static_cast<double>(static_cast<float>(time));
    const DoubleDouble sum = computeDisplacement(place, velocity, pull, time);
    const mpq_class t(time);
    const mpq_class truth = mpq_class(place.to) - mpq_class(place.from) +
                            (mpq_class(velocity.to) - mpq_class(velocity.from)) * t +
                            (mpq_class(pull.to) - mpq_class(pull.from)) * t * t / 2;
    const mpq_class off = abs(truth - mpq_class(sum.high) - mpq_class(sum.low));
    EXPECT_LE(off, mpq_class(sum.error)) << i;
    EXPECT_LE(sum.error, 0x1p-90 * (1e6 + 1e12 + 1e18));
    exact += sum.error == 0 ? 1 : 0;
  }
  EXPECT_GT(exact, 500);
  EXPECT_LT(exact, 1500);
}

}  // namespace
}  // namespace enfilade::collision
