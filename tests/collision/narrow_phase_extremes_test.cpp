// Extreme exponents, and bodies far from their own origin.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

constexpr double kRounding = 0x1p-53;

std::vector<Vec3> makeCubeAround(const Vec3& centre, double half) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 8; ++k)
    corners.emplace_back(centre +
                         half * Vec3(k & 1 ? 1.0 : -1.0, k & 2 ? 1.0 : -1.0, k & 4 ? 1.0 : -1.0));
  return corners;
}

TEST(NarrowPhaseExtremes, AnOriginFarFromItsBodyKeepsTheBound) {
  const std::vector<Vec3> a = makeCubeAround({0, 0, 0}, 1), b = makeCubeAround({-1e6, 0, 0}, 1);
  FeatureCache cache;
  const SeparationResult d = computeSeparation({a, Vec3::Zero()}, {b, {1e6 + 4, 0, 0}}, cache);
  EXPECT_EQ(d.verdict, Verdict::separated);
  EXPECT_LE(std::abs(d.distance - 2), d.errorBound);
  EXPECT_LE(d.errorBound, 16 * kRounding * 5);  // the largest coordinate is B's far side
}

/// Uses hulls, so that hill climbing and its slack are tested.
TEST(NarrowPhaseExtremes, HullsOfAnySizeHaveTheSameVerdicts) {
  for (const int exponent : {-560, -530, -356, -200, 0, 200, 400, 500}) {
    const double unit = std::ldexp(1.0, exponent);
    const Hull a = buildHull(makeCubeAround({0, 0, 0}, unit));
    const Hull b = buildHull(makeCubeAround({0, 0, 0}, unit / 2));
    const auto verdictAt = [&](double x) {
      FeatureCache cache;
      return computeSeparation({a.vertices, Vec3::Zero(), nullptr, &a},
                               {b.vertices, Vec3(x, 0.25, 0.125) * unit, nullptr, &b}, cache)
          .verdict;
    };
    EXPECT_EQ(verdictAt(1.75), Verdict::separated) << exponent;
    EXPECT_EQ(verdictAt(1.5), Verdict::touching) << exponent;
    EXPECT_EQ(verdictAt(1.25), Verdict::penetrating) << exponent;
  }
}

TEST(NarrowPhaseExtremes, DistancesOfAnySizeLieWithinTheirBound) {
  const std::vector<Vec3> a{{0, 0, 0}};
  for (int exponent = -1000; exponent <= 900; exponent += 50) {
    const double distance = std::ldexp(1.58, exponent);
    const std::vector<Vec3> b{{distance, 0, 0}};
    FeatureCache cache;
    const SeparationResult d = computeSeparation({a, Vec3::Zero()}, {b, Vec3::Zero()}, cache);
    EXPECT_EQ(d.verdict, Verdict::separated) << exponent;
    EXPECT_LE(std::abs(d.distance - distance), d.errorBound) << exponent;
    // A distance that is not a double.
    const std::vector<Vec3> slanted{{distance, distance, 0}};
    FeatureCache other;
    const SeparationResult s = computeSeparation({a, Vec3::Zero()}, {slanted, Vec3::Zero()}, other);
    const long double truth = std::sqrt(2.0L) * static_cast<long double>(distance);
    EXPECT_LE(std::abs(static_cast<long double>(s.distance) - truth),
              static_cast<long double>(s.errorBound))
        << exponent;
    FeatureCache none;
    EXPECT_TRUE(computeSeparationWithin({a, Vec3::Zero()}, {b, Vec3::Zero()}, distance * 1.01, none)
                    .has_value())
        << exponent;
  }
}

TEST(NarrowPhaseExtremes, ADepthThatIsCalledGlobalIsTheDepthAtAnyScale) {
  for (const int exponent : {-400, -170, -40, 0, 40, 200, 300}) {
    const double unit = std::ldexp(1.0, exponent);
    const std::vector<Vec3> box = makeCubeAround({0, 0, 0}, unit);
    const PlacedConvex a{box, Vec3::Zero()}, b{box, Vec3(1.75, 0.5, 0.25) * unit};
    FeatureCache cache;
    ASSERT_EQ(computeSeparation(a, b, cache).verdict, Verdict::penetrating) << exponent;
    DepthCache none;
    const PenetrationResult depth = computePenetrationDepth(a, b, cache, none);
    EXPECT_TRUE(depth.global) << exponent;
    EXPECT_NEAR(depth.depth / unit, 0.25, 1e-14) << exponent;
  }
}

RefinedSeparation refineSeparationCold(const PlacedConvex& a, const PlacedConvex& b) {
  FeatureCache cache;
  return refineSeparation(a, b, cache);
}

std::vector<Vec3> scalePoints(std::vector<Vec3> points, double unit) {
  for (Vec3& p : points) p *= unit;
  return points;
}

/// The depth is correct even if numbers are so large that squares of areas overflow.
TEST(NarrowPhaseExtremes, RefinedDepthsScaleExactlyUpToTheLargestNumbers) {
  testing::Random random(11);
  int penetrating = 0;
  for (int i = 0; i < 200; ++i) {
    const std::vector<Vec3> a = testing::makeLatticePoints(random, 6, 3);
    const std::vector<Vec3> b = testing::makeLatticePoints(random, 6, 3);
    const RefinedSeparation here = refineSeparationCold({a}, {b});
    for (const int exponent : {-300, 260, 465}) {
      const double unit = std::ldexp(1.0, exponent);
      const RefinedSeparation there =
          refineSeparationCold({scalePoints(a, unit)}, {scalePoints(b, unit)});
      ASSERT_EQ(there.verdict, here.verdict) << i << " at 2^" << exponent;
      EXPECT_EQ(there.penetration, here.penetration * unit) << i << " at 2^" << exponent;
    }
    penetrating += here.verdict == Verdict::penetrating;
  }
  EXPECT_GT(penetrating, 50);
}

/// Values are in units of the smallest double, their rounding unit; the bound includes it.
TEST(NarrowPhaseExtremes, AmongTheLeastNumbersDistancesAndDepthsAreRounded) {
  constexpr double kMinPositive = std::numeric_limits<double>::denorm_min();
  testing::Random random(12);
  std::array<int, 3> seen{};
  for (int i = 0; i < 300; ++i) {
    const Vec3 at = testing::makeLatticePoints(random, 1, 4)[0];
    const std::vector<Vec3> a = testing::makeLatticePoints(random, 5, 3);
    const std::vector<Vec3> b = testing::makeLatticePoints(random, 5, 3);
    const RefinedSeparation large = refineSeparationCold({a, at}, {b});
    const std::vector<Vec3> smallA = scalePoints(a, kMinPositive),
                            smallB = scalePoints(b, kMinPositive);
    const RefinedSeparation small = refineSeparationCold({smallA, kMinPositive * at}, {smallB});
    ASSERT_EQ(small.verdict, large.verdict) << i;
    EXPECT_EQ(small.distance, std::nearbyint(large.distance) * kMinPositive) << i;
    EXPECT_EQ(small.penetration, std::nearbyint(large.penetration) * kMinPositive) << i;
    FeatureCache cache;
    const SeparationResult decided =
        computeSeparation({smallA, kMinPositive * at}, {smallB}, cache);
    EXPECT_LE(std::abs(decided.distance / kMinPositive - large.distance),
              decided.errorBound / kMinPositive + 1e-14)
        << i;
    ++seen[static_cast<std::size_t>(large.verdict)];
  }
  for (const int count : seen) EXPECT_GT(count, 3);
}

/// Matrices are used exactly: a mirroring matrix gives the mirrored body.
TEST(NarrowPhaseExtremes, AMirroredBodyIsAsDeepAsItsMirrorImage) {
  Mat3 mirror;
  mirror << 0, 0, -1, -1, 0, 0, 0, -1, 0;
  ASSERT_EQ(mirror.determinant(), -1);
  testing::Random random(13);
  int penetrating = 0;
  for (int i = 0; i < 200; ++i) {
    const Hull a = buildHull(testing::makeLatticePoints(random, 3 + i % 5, 2));
    const Hull b = buildHull(testing::makeLatticePoints(random, 7, 2));
    const Vec3 at = testing::makeLatticePoints(random, 1, 2)[0];
    std::vector<Vec3> image = b.vertices;
    for (Vec3& p : image) p = mirror * p;
    const PlacedConvex first{a.vertices, at, nullptr, &a};
    const RefinedSeparation mirrored =
        refineSeparationCold(first, {b.vertices, Vec3::Zero(), &mirror, &b});
    const RefinedSeparation plain = refineSeparationCold(first, {image});
    ASSERT_EQ(mirrored.verdict, plain.verdict) << i;
    EXPECT_EQ(mirrored.penetration, plain.penetration) << i;
    EXPECT_EQ(refineSeparationCold({b.vertices, Vec3::Zero(), &mirror, &b}, first).penetration,
              plain.penetration)
        << i;
    penetrating += plain.verdict == Verdict::penetrating;
  }
  EXPECT_GT(penetrating, 50);
}

/// The origin lies in a plane of symmetry: on a face, an edge or a corner of every simplex.
TEST(NarrowPhaseExtremes, ADepthIsGlobalInSymmetricPlacesToo) {
  const double c = std::sqrt(0.5);
  Mat3 turned;
  turned << c, -c, 0, c, c, 0, 0, 0, 1;
  const Hull box = buildHull(makeCubeAround({0, 0, 0}, 0.5));
  for (const double x : {0.0, 0.3, 0.7, 1.1, 1.2}) {
    const PlacedConvex a{box.vertices, Vec3::Zero(), nullptr, &box};
    const PlacedConvex b{box.vertices, Vec3(x, 0, 0), &turned, &box};
    FeatureCache cache;
    ASSERT_EQ(computeSeparation(a, b, cache).verdict, Verdict::penetrating) << x;
    DepthCache none;
    const PenetrationResult depth = computePenetrationDepth(a, b, cache, none);
    EXPECT_TRUE(depth.global) << x;
    EXPECT_NEAR(depth.depth, std::min(1.0, 0.5 + c - x), 1e-14) << x;
  }
}

TEST(NarrowPhaseExtremes, NonFiniteNumbersAreRefusedByName) {
  const std::vector<Vec3> cube = makeCubeAround({0, 0, 0}, 1);
  const double none = std::nan(""), infinite = std::numeric_limits<double>::infinity();
  const Mat3 noRotation = Mat3::Constant(none);
  const std::vector<Vec3> noCorner{{0, 0, 0}, {none, 0, 0}};
  const PlacedConvex good{cube, Vec3::Zero()};
  for (const PlacedConvex& bad :
       {PlacedConvex{cube, {0, none, 0}}, PlacedConvex{cube, {infinite, 0, 0}},
        PlacedConvex{cube, Vec3::Zero(), &noRotation}, PlacedConvex{noCorner, Vec3::Zero()},
        PlacedConvex{{}, Vec3::Zero()}}) {
    FeatureCache cache;
    EXPECT_THROW(computeSeparation(good, bad, cache), std::invalid_argument);
    EXPECT_THROW(refineSeparation(bad, good, cache), std::invalid_argument);
  }
}

TEST(NarrowPhaseExtremes, NothingIsFartherThanInfinitelyFar) {
  const std::vector<Vec3> cube = makeCubeAround({0, 0, 0}, 1);
  FeatureCache cache;
  EXPECT_TRUE(isCloserThan({cube, Vec3::Zero()}, {cube, {5, 0, 0}},
                           std::numeric_limits<double>::infinity(), cache));
}

}  // namespace
}  // namespace enfilade::collision
