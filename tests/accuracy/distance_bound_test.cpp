// What decide() proves of a distance, against rationals: bodies in motion, asked warm, so that the
// search ends at directions that slip from the closest points' and at features that others reach
// past by a rounding. Sheared bodies, slivers, and bodies far from their own origin, where the
// terms of the bound differ most from those of a rotation at home.
#include <gtest/gtest.h>

#include <cmath>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/accuracy/exact_geometry.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::accuracy {
namespace {

using collision::ConvexBody;
using collision::DecidedBy;
using collision::Decision;
using collision::FeatureCache;
using collision::Hull;
using collision::Verdict;
using collision::testing::Random;
using collision::testing::randomPoint;
using collision::testing::randomPoints;
using collision::testing::uniform;

constexpr double kRounding = 0x1p-53;

/// A body that turns about its middle.
struct Turning {
  Hull hull;
  Mat3 shape;   ///< worldFromBody at rest: sheared for some
  Vec3 middle;  ///< body's frame
  Vec3 axis;
  Placed placed;

  void turnTo(double angle, const Vec3& place) {
    placed.rotation = Eigen::AngleAxisd(angle, axis).toRotationMatrix() * shape;
    placed.translation = place - placed.rotation * middle;
  }
  ConvexBody body(bool withHull) const {
    return {hull.vertices, placed.translation, &placed.rotation, withHull ? &hull : nullptr};
  }
};

struct Kind {
  const char* name;
  double thickness;  ///< of a body one metre wide
  double shear;
  double offset;  ///< metres from its origin
};

/// The corners of a box, and points on its faces; all of them beside their place by up to
/// `unevenness`, so that more than three are nearly as far as the farthest.
std::vector<Vec3> nearlyFlat(Random& random, double unevenness) {
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i)
    points.emplace_back((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
  for (int i = 0; i < 8; ++i) {
    Vec3 p = randomPoint(random, 1);
    p[i % 3] = i % 2 == 0 ? 1 : -1;
    points.push_back(p);
  }
  for (Vec3& p : points) p += randomPoint(random, unevenness);
  return points;
}

Turning turning(Random& random, const Kind& kind, std::vector<Vec3> points) {
  Turning made;
  made.middle = randomPoint(random, kind.offset);
  for (Vec3& p : points) {
    p.z() *= kind.thickness;
    p += made.middle;
  }
  made.hull = collision::buildHull(points);
  made.placed.points = made.hull.vertices;
  made.shape = Mat3::Identity();
  for (double& entry : made.shape.reshaped()) entry += uniform(random, -kind.shear, kind.shear);
  made.axis = randomPoint(random, 1).normalized();
  return made;
}

NearestPoint nearestOf(const Turning& a, const Turning& b, long& bits) {
  const ExactPair pair = exactPair(a.placed, b.placed);
  bits = pair.bits;
  return nearestOfDifference(pair.a, pair.b);
}

Vec3 towards(const NearestPoint& nearest) {
  const auto coordinate = [&](const mpz_class& of) {
    return mpq_class(of, nearest.denominator).get_d();
  };
  const auto& [x, y, z] = nearest.numerator;
  return Vec3(coordinate(x), coordinate(y), coordinate(z)).stableNormalized();
}

mpf_class exactDistance(const Turning& a, const Turning& b) {
  long bits = 0;
  const NearestPoint nearest = nearestOf(a, b, bits);
  return lengthOf(nearest, bits);
}

/// B comes to stand `gap` metres from A, up to rounding.
void approach(const Turning& a, Turning& b, double gap) {
  long bits = 0;
  const NearestPoint nearest = nearestOf(a, b, bits);
  b.placed.translation -= (lengthOf(nearest, bits).get_d() - gap) * towards(nearest);
}

/// Of both bodies, from A's translation.
double largestCoordinate(const Turning& a, const Turning& b) {
  double largest = 0;
  for (const Turning* body : {&a, &b})
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
  int asked = 0, byFilter = 0, provedFarther = 0;
  for (const double gap : {1.0, 1e-4, 1e-7, 1e-8, 3e-9}) {
    for (int pair = 0; pair < kPairs; ++pair) {
      const bool flat = pair % 3 != 0;
      const double small = std::ldexp(1.0, -static_cast<int>(random() % 48));
      const auto points = [&] {
        return flat ? nearlyFlat(random, small) : randomPoints(random, 9, 1);
      };
      Turning a = turning(random, GetParam(), points());
      Turning b = turning(random, GetParam(), points());
      const double angle = flat ? std::ldexp(0.02, -static_cast<int>(random() % 48)) : 0.02;
      const Vec3 place = randomPoint(random, 3);
      const Vec3 away = flat ? Vec3(a.shape.col(pair % 2)) : randomPoint(random, 1).normalized();
      FeatureCache cache, limited;
      for (int step = 0; step < kSteps; ++step) {
        a.turnTo(angle * step, place);
        b.turnTo(-1.5 * angle * step, place + 12 * away);
        approach(a, b, gap);
        const ConvexBody bodyA = a.body(pair % 2 == 0), bodyB = b.body(pair % 2 == 0);
        const mpf_class exact = exactDistance(a, b);
        const Decision told = decide(bodyA, bodyB, cache);
        EXPECT_EQ(told.verdict == Verdict::separated, exact > 0);
        if (told.verdict != Verdict::separated) continue;
        const mpf_class error = abs(preciseNumber(told.distance) - exact);
        EXPECT_LE(error, preciseNumber(told.errorBound)) << gap << ' ' << pair << ' ' << step;
        EXPECT_LE(told.errorBound, 16 * kRounding * largestCoordinate(a, b));
        // The least double that is not less: never proved to be exceeded.
        double limit = exact.get_d();
        while (preciseNumber(limit) < exact) limit = std::nextafter(limit, 2 * limit);
        EXPECT_TRUE(decideWithin(bodyA, bodyB, limit, limited))
            << gap << ' ' << pair << ' ' << step;
        FeatureCache fresh;
        const double justLess = told.distance - 2 * told.errorBound;
        provedFarther += justLess > 0 && !decideWithin(bodyA, bodyB, justLess, fresh) ? 1 : 0;
        ++asked;
        byFilter += told.decidedBy == DecidedBy::filter ? 1 : 0;
      }
    }
  }
  EXPECT_GT(asked, 5 * kPairs * kSteps * 9 / 10);
  EXPECT_GT(byFilter, asked / 2);
  EXPECT_GT(provedFarther, asked * 9 / 10);
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
