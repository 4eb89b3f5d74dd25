// Compares the certified distance of computeSeparation() with rationals. Bodies move and queries
// start warm. GJK therefore ends at directions that deviate from the closest points' and at
// features that others exceed by a rounding. Sheared bodies, slivers, and bodies far from their own
// origin stress the terms of the bound most.
#include <gtest/gtest.h>

#include <cmath>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/accuracy/exact_geometry.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::accuracy {
namespace {

using collision::Certificate;
using collision::FeatureCache;
using collision::Hull;
using collision::PlacedConvex;
using collision::SeparationResult;
using collision::Verdict;
using collision::testing::drawUniform;
using collision::testing::makeRandomPoint;
using collision::testing::makeRandomPoints;
using collision::testing::Random;

constexpr double kRounding = 0x1p-53;

/// A body that rotates about its centre.
struct RotatingBody {
  Hull hull;
  Mat3 shape;   ///< worldFromBody at rest: sheared for some
  Vec3 middle;  ///< body's frame
  Vec3 axis;
  Placed placed;

  void rotateTo(double angle, const Vec3& place) {
    placed.rotation = Eigen::AngleAxisd(angle, axis).toRotationMatrix() * shape;
    placed.translation = place - placed.rotation * middle;
  }
  PlacedConvex getBody(bool withHull) const {
    return {hull.vertices, placed.translation, &placed.rotation, withHull ? &hull : nullptr};
  }
};

struct Kind {
  const char* name;
  double thickness;  ///< of a body one metre wide
  double shear;
  double offset;  ///< metres from its origin
};

/// The corners of a box and points on its faces, displaced by up to `unevenness`. More than three
/// vertices are then close to the support plane.
std::vector<Vec3> makeNearlyFlat(Random& random, double unevenness) {
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i)
    points.emplace_back((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
  for (int i = 0; i < 8; ++i) {
    Vec3 p = makeRandomPoint(random, 1);
    p[i % 3] = i % 2 == 0 ? 1 : -1;
    points.push_back(p);
  }
  for (Vec3& p : points) p += makeRandomPoint(random, unevenness);
  return points;
}

RotatingBody makeRotatingBody(Random& random, const Kind& kind, std::vector<Vec3> points) {
  RotatingBody result;
  result.middle = makeRandomPoint(random, kind.offset);
  for (Vec3& p : points) {
    p.z() *= kind.thickness;
    p += result.middle;
  }
  result.hull = collision::buildHull(points);
  result.placed.points = result.hull.vertices;
  result.shape = Mat3::Identity();
  for (double& entry : result.shape.reshaped())
    entry += drawUniform(random, -kind.shear, kind.shear);
  result.axis = makeRandomPoint(random, 1).normalized();
  return result;
}

NearestPoint findNearest(const RotatingBody& a, const RotatingBody& b, long& bits) {
  const ExactPair pair = makeExactPair(a.placed, b.placed);
  bits = pair.bits;
  return findNearestOfDifference(pair.a, pair.b);
}

Vec3 computeDirectionTo(const NearestPoint& nearest) {
  const auto coordinate = [&](const mpz_class& of) {
    return mpq_class(of, nearest.denominator).get_d();
  };
  const auto& [x, y, z] = nearest.numerator;
  return Vec3(coordinate(x), coordinate(y), coordinate(z)).stableNormalized();
}

mpf_class computeExactDistance(const RotatingBody& a, const RotatingBody& b) {
  long bits = 0;
  const NearestPoint nearest = findNearest(a, b, bits);
  return computeLength(nearest, bits);
}

/// Moves B to `gap` metres from A, up to rounding.
void moveToDistance(const RotatingBody& a, RotatingBody& b, double gap) {
  long bits = 0;
  const NearestPoint nearest = findNearest(a, b, bits);
  b.placed.translation -=
      (computeLength(nearest, bits).get_d() - gap) * computeDirectionTo(nearest);
}

/// The maximum |coordinate| of both bodies relative to A's translation.
double computeMaxCoordinate(const RotatingBody& a, const RotatingBody& b) {
  double largest = 0;
  for (const RotatingBody* body : {&a, &b})
    for (const Vec3& p : body->placed.points)
      largest = std::max(
          largest, (body->placed.rotation * p + (body->placed.translation - a.placed.translation))
                       .cwiseAbs()
                       .maxCoeff());
  return largest;
}

class DistanceBound : public ::testing::TestWithParam<Kind> {};

TEST_P(DistanceBound, HoldsTheExactDistanceWhileBodiesTurn) {
  constexpr int kSteps = 12, kPairs = 15;
  Random random(7);
  int queryCount = 0, byFilter = 0, provedFarther = 0;
  for (const double gap : {1.0, 1e-4, 1e-7, 1e-8, 3e-9}) {
    for (int pair = 0; pair < kPairs; ++pair) {
      const bool flat = pair % 3 != 0;
      const double small = std::ldexp(1.0, -static_cast<int>(random() % 48));
      const auto points = [&] {
        return flat ? makeNearlyFlat(random, small) : makeRandomPoints(random, 9, 1);
      };
      RotatingBody a = makeRotatingBody(random, GetParam(), points());
      RotatingBody b = makeRotatingBody(random, GetParam(), points());
      const double angle = flat ? std::ldexp(0.02, -static_cast<int>(random() % 48)) : 0.02;
      const Vec3 place = makeRandomPoint(random, 3);
      const Vec3 away =
          flat ? Vec3(a.shape.col(pair % 2)) : makeRandomPoint(random, 1).normalized();
      FeatureCache cache, limited;
      for (int step = 0; step < kSteps; ++step) {
        a.rotateTo(angle * step, place);
        b.rotateTo(-1.5 * angle * step, place + 12 * away);
        moveToDistance(a, b, gap);
        const PlacedConvex bodyA = a.getBody(pair % 2 == 0), bodyB = b.getBody(pair % 2 == 0);
        const mpf_class exact = computeExactDistance(a, b);
        const SeparationResult reported = computeSeparation(bodyA, bodyB, cache);
        EXPECT_EQ(reported.verdict == Verdict::separated, exact > 0);
        if (reported.verdict != Verdict::separated) continue;
        const mpf_class error = abs(toPreciseNumber(reported.distance) - exact);
        EXPECT_LE(error, toPreciseNumber(reported.errorBound)) << gap << ' ' << pair << ' ' << step;
        EXPECT_LE(reported.errorBound, 16 * kRounding * computeMaxCoordinate(a, b));
        // The smallest double that is not below the distance must not be certified as exceeded.
        double limit = exact.get_d();
        while (toPreciseNumber(limit) < exact) limit = std::nextafter(limit, 2 * limit);
        EXPECT_TRUE(computeSeparationWithin(bodyA, bodyB, limit, limited))
            << gap << ' ' << pair << ' ' << step;
        FeatureCache fresh;
        const double justLess = reported.distance - 2 * reported.errorBound;
        provedFarther +=
            justLess > 0 && !computeSeparationWithin(bodyA, bodyB, justLess, fresh) ? 1 : 0;
        ++queryCount;
        byFilter += reported.certificate == Certificate::filter ? 1 : 0;
      }
    }
  }
  EXPECT_GT(queryCount, 5 * kPairs * kSteps * 9 / 10);
  EXPECT_GT(byFilter, queryCount / 2);
  EXPECT_GT(provedFarther, queryCount * 9 / 10);
}

INSTANTIATE_TEST_SUITE_P(All, DistanceBound,
                         ::testing::Values(Kind{"Rotated", 1, 0, 0}, Kind{"Sheared", 1, 0.9, 0},
                                           Kind{"Slivers", 1e-7, 0, 0},
                                           Kind{"ShearedSlivers", 1e-9, 0.9, 0},
                                           Kind{"FarFromTheirOrigin", 1, 0, 1e5},
                                           Kind{"ShearedFarFromTheirOrigin", 1, 0.9, 1e5}),
                         [](const auto& kind) { return std::string(kind.param.name); });

}  // namespace
}  // namespace enfilade::accuracy
