#include "collision/narrow_phase/narrow_phase.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "tests/collision/random_shapes.hpp"
#include "tests/collision/rational_verdict.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

SeparationResult computeSeparationCold(const PlacedConvex& a, const PlacedConvex& b) {
  FeatureCache cache;
  return computeSeparation(a, b, cache);
}

// ---- reference implementations -----------------------------------------------------------------

double computePointSegmentDistance(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - (a + t * (b - a))).norm();
}

double computeSegmentDistance(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  double best = std::min(
      std::min(computePointSegmentDistance(a, c, d), computePointSegmentDistance(b, c, d)),
      std::min(computePointSegmentDistance(c, a, b), computePointSegmentDistance(d, a, b)));
  const Vec3 n = (b - a).cross(d - c);
  if (n.squaredNorm() < 1e-24) return best;
  const double s = (c - a).cross(d - c).dot(n) / n.squaredNorm();
  const double t = (c - a).cross(b - a).dot(n) / n.squaredNorm();
  if (s >= 0 && s <= 1 && t >= 0 && t <= 1)
    best = std::min(best, std::abs((c - a).dot(n)) / n.norm());
  return best;
}

double computePointTriangleDistance(const Vec3& p, const Triangle& t) {
  double best = std::min(computePointSegmentDistance(p, t[0], t[1]),
                         std::min(computePointSegmentDistance(p, t[1], t[2]),
                                  computePointSegmentDistance(p, t[2], t[0])));
  const Vec3 n = (t[1] - t[0]).cross(t[2] - t[0]);
  for (int i = 0; i < 3; ++i)
    if ((t[(i + 1) % 3] - t[i]).cross(p - t[i]).dot(n) < 0) return best;
  return std::min(best, std::abs((p - t[0]).dot(n)) / n.norm());
}

/// Distance of two disjoint triangles: a vertex and a face, or two edges.
double computeTriangleDistance(const Triangle& a, const Triangle& b) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    best = std::min(
        {best, computePointTriangleDistance(a[i], b), computePointTriangleDistance(b[i], a)});
    for (int j = 0; j < 3; ++j)
      best = std::min(best, computeSegmentDistance(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]));
  }
  return best;
}

double computeBruteForceDistance(const std::vector<Triangle>& a, const std::vector<Triangle>& b) {
  double best = std::numeric_limits<double>::infinity();
  for (const Triangle& s : a)
    for (const Triangle& t : b) best = std::min(best, computeTriangleDistance(s, t));
  return best;
}

// ---- known answers -----------------------------------------------------------------------------

TEST(NarrowPhase, CubesTwoMetresApartAreTwoMetresApart) {
  const SeparationResult d =
      computeSeparationCold({kUnitCube, Vec3::Zero()}, {kUnitCube, {3, 0, 0}});
  EXPECT_EQ(d.verdict, Verdict::separated);
  EXPECT_EQ(d.certificate, Certificate::filter);
  EXPECT_NEAR(d.distance, 2, 1e-15);
  EXPECT_TRUE(d.normal.isApprox(Vec3::UnitX(), 1e-15));
  EXPECT_NEAR((d.pointB - d.pointA).norm(), 2, 1e-14);
}

TEST(NarrowPhase, CubesFaceToFaceTouch) {
  const SeparationResult d =
      computeSeparationCold({kUnitCube, Vec3::Zero()}, {kUnitCube, {1, 0.25, 0.5}});
  EXPECT_EQ(d.verdict, Verdict::touching);
  EXPECT_EQ(d.certificate, Certificate::expansion);
  EXPECT_EQ(d.distance, 0);
}

TEST(NarrowPhase, CubesThatShareOneCornerTouch) {
  EXPECT_EQ(computeSeparationCold({kUnitCube, Vec3::Zero()}, {kUnitCube, {1, 1, 1}}).verdict,
            Verdict::touching);
}

TEST(NarrowPhase, OneUlpDecides) {
  const double next = std::nextafter(1.0, 2.0), before = std::nextafter(1.0, 0.0);
  const auto verdictAt = [](double x) {
    return computeSeparationCold({kUnitCube, Vec3::Zero()}, {kUnitCube, {x, 0.25, 0.5}}).verdict;
  };
  EXPECT_EQ(verdictAt(next), Verdict::separated);
  EXPECT_EQ(verdictAt(1.0), Verdict::touching);
  EXPECT_EQ(verdictAt(before), Verdict::penetrating);
}

TEST(NarrowPhase, DeepOverlapIsPenetratingByTheLeastDepth) {
  const PlacedConvex a{kUnitCube, Vec3::Zero()}, b{kUnitCube, {0.75, 0.1, 0.05}};
  FeatureCache cache;
  EXPECT_EQ(computeSeparation(a, b, cache).verdict, Verdict::penetrating);
  DepthCache none;
  const PenetrationResult depth = computePenetrationDepth(a, b, cache, none);
  EXPECT_TRUE(depth.global);
  EXPECT_NEAR(depth.depth, 0.25, 1e-15);
  EXPECT_TRUE(depth.normal.isApprox(Vec3::UnitX(), 1e-15));
}

TEST(NarrowPhase, OverlappingPolygonsInOnePlaneOnlyTouch) {
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  EXPECT_EQ(computeSeparationCold({square, Vec3::Zero()}, {square, {0.5, 0.5, 0}}).verdict,
            Verdict::touching);
}

TEST(NarrowPhase, ASegmentThroughATriangleTouchesItsEdgeAndPenetratesItsInside) {
  const std::vector<Vec3> triangle{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}};
  const std::vector<Vec3> segment{{0, 0, -1}, {0, 0, 1}};
  EXPECT_EQ(computeSeparationCold({segment, {0.5, 0.5, 0}}, {triangle, Vec3::Zero()}).verdict,
            Verdict::penetrating);
  EXPECT_EQ(computeSeparationCold({segment, {0.5, 0, 0}}, {triangle, Vec3::Zero()}).verdict,
            Verdict::touching);
}

TEST(NarrowPhase, FarFromTheOriginNothingIsLost) {
  const Vec3 far{1e7, -3e6, 5e6};
  const double gap = 0x1p-20;  // about a micrometre, exact when added to 1e7
  const SeparationResult d =
      computeSeparationCold({kUnitCube, far}, {kUnitCube, far + Vec3(1 + gap, 0, 0)});
  EXPECT_EQ(d.verdict, Verdict::separated);
  EXPECT_NEAR(d.distance, gap, 1e-15);
}

TEST(NarrowPhase, GivesUpAsSoonAsTheLimitIsProved) {
  FeatureCache cache;
  EXPECT_FALSE(
      computeSeparationWithin({kUnitCube, Vec3::Zero()}, {kUnitCube, {3, 0, 0}}, 1.5, cache));
  EXPECT_TRUE(
      computeSeparationWithin({kUnitCube, Vec3::Zero()}, {kUnitCube, {3, 0, 0}}, 2.5, cache));
  EXPECT_GT(computeSeparationLowerBound({kUnitCube, Vec3::Zero()}, {kUnitCube, {3, 0, 0}}, cache),
            1.5);
}

/// Also for axes of any length, for faces that lie on each other, and next to the bound itself.
TEST(NarrowPhase, AProvedSeparationIsThatOfTheLowerBound) {
  Random random(11);
  int proved = 0, refused = 0;
  for (int i = 0; i < 400; ++i) {
    const bool flat = i % 3 == 0;
    const Hull a =
        buildHull(flat ? makeLatticePoints(random, 30, 2) : makeRandomPoints(random, 20, 1));
    const Hull b =
        buildHull(flat ? makeLatticePoints(random, 30, 2) : makeRandomPoints(random, 90, 1));
    const Mat3 turned =
        Eigen::AngleAxisd(drawUniform(random, 0, 3), makeRandomPoint(random, 1).normalized())
            .matrix();
    const PlacedConvex atA{a.vertices, Vec3::Zero(), nullptr, &a};
    const PlacedConvex atB{b.vertices, Vec3(flat ? 5 : drawUniform(random, 0, 4), 0, 0),
                           flat ? nullptr : &turned, &b};
    FeatureCache cache;
    computeSeparation(atA, atB, cache);
    cache.axis *= i % 7 == 0 ? 1e-120 : drawUniform(random, 0.1, 10);
    const double bound = computeSeparationLowerBound(atA, atB, cache);
    for (const double distance :
         {0.0, 0.5 * bound, bound, std::nextafter(bound, -10.0), std::nextafter(bound, 10.0),
          bound - 1e-15, bound + 1e-15, bound - 1e-9, bound + 1e-9, bound + 1}) {
      ASSERT_EQ(isSeparationProved(atA, atB, distance, cache), bound > distance)
          << i << ": " << distance << " of " << bound;
      ++(bound > distance ? proved : refused);
    }
  }
  EXPECT_GT(proved, 500);
  EXPECT_GT(refused, 500);
}

// ---- against the references --------------------------------------------------------------------

TEST(NarrowPhase, HullsAndTrianglesAgreeWithBruteForceOverFeatures) {
  Random random(1);
  int separated = 0;
  for (int i = 0; i < 600; ++i) {
    const Hull hull = buildHull(makeRandomPoints(random, 14, 1));
    const std::vector<Vec3> triangle = makeRandomPoints(random, 3, 1.5);
    const Vec3 at = makeRandomPoint(random, 1.6);
    const SeparationResult d = computeSeparationCold({hull.vertices, at}, {triangle, Vec3::Zero()});
    if (d.verdict != Verdict::separated) continue;
    ++separated;
    const double reference = computeBruteForceDistance(makeBoundary(hull, at),
                                                       {{triangle[0], triangle[1], triangle[2]}});
    EXPECT_NEAR(d.distance, reference, 1e-13) << "case " << i;
    EXPECT_LE(std::abs(d.distance - reference), d.errorBound + 1e-14) << "case " << i;
    EXPECT_LT(d.errorBound, 1e-12) << "case " << i;
    EXPECT_NEAR((d.pointB - d.pointA).norm(), d.distance, 1e-13) << "case " << i;
  }
  EXPECT_GT(separated, 200);
  EXPECT_LT(separated, 500);
}

TEST(NarrowPhase, VerdictsOnALatticeEqualExactArithmeticWhicheverWayTheyWereDecided) {
  Random random(2);
  std::array<int, 3> seen{};
  for (int i = 0; i < 1500; ++i) {
    const std::vector<Vec3> a = makeLatticePoints(random, 1 + static_cast<int>(random() % 6), 2);
    const std::vector<Vec3> b = makeLatticePoints(random, 1 + static_cast<int>(random() % 6), 2);
    const Vec3 at = makeLatticePoints(random, 1, 2)[0];
    const Verdict exact = computeRationalVerdict({a, at}, {b, Vec3::Zero()});
    EXPECT_EQ(computeSeparationCold({a, at}, {b, Vec3::Zero()}).verdict, exact) << "case " << i;
    EXPECT_EQ(computeRationalVerdict({b, Vec3::Zero()}, {a, at}), exact) << "case " << i;
    ++seen[static_cast<std::size_t>(exact)];
  }
  for (const int count : seen) EXPECT_GT(count, 60);
}

TEST(NarrowPhase, TinyAndHugeBodiesAreDecidedExactlyThoughDoublesUnderAndOverflow) {
  Random random(6);
  std::array<int, 3> seen{};
  for (int i = 0; i < 600; ++i) {
    const double scale = std::array{0x1p-530, 0x1p-356, 0x1p520}[static_cast<std::size_t>(i % 3)];
    std::vector<Vec3> a = makeLatticePoints(random, 5, 2), b = makeLatticePoints(random, 5, 2);
    const Vec3 at = makeLatticePoints(random, 1, 2)[0];
    for (Vec3& p : a) p *= scale;
    for (Vec3& p : b) p *= i % 2 == 0 ? scale : scale / 3;
    const PlacedConvex bodyA{a, scale * at}, bodyB{b};
    const Verdict exact = computeRationalVerdict(bodyA, bodyB);
    EXPECT_EQ(computeSeparationCold(bodyA, bodyB).verdict, exact) << "case " << i;
    ++seen[static_cast<std::size_t>(exact)];
  }
  for (const int count : seen) EXPECT_GT(count, 10);
}

TEST(NarrowPhase, SwappingTheBodiesSwapsTheAnswer) {
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    const std::vector<Vec3> a = makeRandomPoints(random, 10, 1);
    const std::vector<Vec3> b = makeRandomPoints(random, 3, 2);
    const Vec3 at = makeRandomPoint(random, 3);
    const SeparationResult ab = computeSeparationCold({a, at}, {b, Vec3::Zero()});
    const SeparationResult ba = computeSeparationCold({b, Vec3::Zero()}, {a, at});
    ASSERT_EQ(ab.verdict, ba.verdict);
    if (ab.verdict != Verdict::separated) continue;
    EXPECT_NEAR(ab.distance, ba.distance, 1e-13);
    EXPECT_TRUE(ab.normal.isApprox(-ba.normal, 1e-7));
    EXPECT_EQ(ab.featureA, ba.featureB);
    EXPECT_EQ(ab.featureB, ba.featureA);
  }
}

/// The feature of a hull in general position that is farthest along a direction.
Feature findFarthestFeature(const Hull& hull, const Vec3& direction) {
  double maxProjection = -std::numeric_limits<double>::infinity();
  for (const Vec3& v : hull.vertices) maxProjection = std::max(maxProjection, direction.dot(v));
  const auto isFarthest = [&](const Vec3& v) { return direction.dot(v) > maxProjection - 1e-9; };
  switch (std::ranges::count_if(hull.vertices, isFarthest)) {
    case 1:
      return Feature::vertex;
    case 2:
      return Feature::edge;
    default:
      return Feature::face;
  }
}

TEST(NarrowPhase, NamesTheClosestFeatures) {
  Random random(14);
  std::map<std::pair<Feature, Feature>, int> seen;
  for (int i = 0; i < 400; ++i) {
    const Hull a = buildHull(makeRandomPoints(random, 8, 1)),
               b = buildHull(makeRandomPoints(random, 8, 1));
    const PlacedConvex bodyA{.vertices = a.vertices, .hull = &a};
    const PlacedConvex bodyB{
        .vertices = b.vertices, .translation = makeRandomPoint(random, 3), .hull = &b};
    const SeparationResult d = computeSeparationCold(bodyA, bodyB);
    if (d.verdict == Verdict::penetrating) {
      EXPECT_EQ(d.featureA, Feature::none);
      EXPECT_EQ(d.featureB, Feature::none);
      continue;
    }
    EXPECT_EQ(d.featureA, findFarthestFeature(a, d.normal)) << i;
    EXPECT_EQ(d.featureB, findFarthestFeature(b, -d.normal)) << i;
    ++seen[{d.featureA, d.featureB}];
  }
  for (const auto& [first, second] :
       {std::pair(Feature::vertex, Feature::vertex), std::pair(Feature::vertex, Feature::edge),
        std::pair(Feature::vertex, Feature::face), std::pair(Feature::edge, Feature::edge)}) {
    EXPECT_GT((seen[{first, second}]), 5);
    EXPECT_GT((seen[{second, first}]), 5);
  }
}

TEST(NarrowPhase, APointOverAFacesDiagonalIsOverAFace) {
  const Hull cube = buildHull(kUnitCube);
  const std::vector<Vec3> point{Vec3::Zero()};
  const PlacedConvex body{.vertices = cube.vertices, .hull = &cube};
  for (const double height : {1.0, 1.5}) {  // touching, separated
    for (const double at : {0.25, 0.5, 0.75}) {
      const SeparationResult d = computeSeparationCold(body, {point, {at, at, height}});
      EXPECT_EQ(d.featureA, Feature::face) << at << " " << height;
      EXPECT_EQ(d.featureB, Feature::vertex);
      const SeparationResult other = computeSeparationCold(body, {point, {at, 1 - at, height}});
      EXPECT_EQ(other.featureA, Feature::face) << at << " " << height;
    }
    EXPECT_EQ(computeSeparationCold(body, {point, {0, 0.5, height}}).featureA, Feature::edge)
        << height;
    EXPECT_EQ(computeSeparationCold(body, {point, {1, 1, height}}).featureA, Feature::vertex)
        << height;
  }
}

/// The feature of a cube about the origin that contains a point, by the coordinates.
Feature findFeatureAt(const Vec3& p, double half) {
  switch (std::ranges::count_if(p, [&](double x) { return std::abs(std::abs(x) - half) < 1e-9; })) {
    case 1:
      return Feature::face;
    case 2:
      return Feature::edge;
    default:
      return Feature::vertex;
  }
}

TEST(NarrowPhase, PointsLieWithinTheReportedFeatures) {
  constexpr double kHalf = 0.185;
  std::vector<Vec3> corners;
  for (const Vec3& corner : kUnitCube)
    corners.push_back(2 * kHalf * (corner - Vec3(0.5, 0.5, 0.5)));
  const Hull cube = buildHull(corners);
  const PlacedConvex below{.vertices = cube.vertices, .hull = &cube};
  Random random(15);
  int others = 0;  // the exact search found other features than the search in doubles
  for (int i = 0; i < 400; ++i) {
    // Parallel faces, or faces that only exact numbers distinguish from parallel ones.
    const Vec3 axis = i % 2 == 0 ? Vec3::UnitX() : Vec3::UnitY();
    const double turn = i % 4 < 2 ? 1e-13 : 0.5 * std::numbers::pi;
    const Mat3 rotation = Eigen::AngleAxisd(turn, axis).toRotationMatrix();
    const Vec3 at(drawUniform(random, -0.2, 0.2), drawUniform(random, 0.4, 2),
                  drawUniform(random, -0.2, 0.2));
    const PlacedConvex above{
        .vertices = cube.vertices, .translation = at, .rotation = &rotation, .hull = &cube};
    const auto expectFeatures = [&](const auto& reported) {
      EXPECT_EQ(reported.featureA, findFeatureAt(reported.pointA, kHalf)) << i;
      EXPECT_EQ(reported.featureB,
                findFeatureAt(rotation.transpose() * (reported.pointB - at), kHalf))
          << i;
    };
    const SeparationResult decided = computeSeparationCold(below, above);
    FeatureCache cache;
    const RefinedSeparation refined = refineSeparation(below, above, cache);
    expectFeatures(decided);
    expectFeatures(refined);
    others += refined.featureA != decided.featureA || refined.featureB != decided.featureB ? 1 : 0;
  }
  EXPECT_GT(others, 10);
}

TEST(NarrowPhase, MovingByTheDistanceMakesContactAndNotEarlier) {
  Random random(4);
  int tried = 0;
  for (int i = 0; i < 300; ++i) {
    const std::vector<Vec3> a = makeRandomPoints(random, 12, 1);
    const std::vector<Vec3> b = makeRandomPoints(random, 12, 1);
    const Vec3 at = makeRandomPoint(random, 4);
    const SeparationResult d = computeSeparationCold({a, at}, {b, Vec3::Zero()});
    if (d.verdict != Verdict::separated) continue;
    ++tried;
    const auto moved = [&](double by) {
      return computeSeparationCold({a, at + by * d.normal}, {b, Vec3::Zero()});
    };
    EXPECT_EQ(moved(d.distance - 1e-12).verdict, Verdict::separated);
    EXPECT_LT(moved(d.distance).distance, 1e-12);
    EXPECT_NEAR(moved(0.5 * d.distance).distance, 0.5 * d.distance, 1e-12);
  }
  EXPECT_GT(tried, 150);
}

TEST(NarrowPhase, AWarmStartChangesTheWorkAndNotTheAnswer) {
  Random random(5);
  const std::vector<Vec3> a = makeRandomPoints(random, 20, 1);
  const std::vector<Vec3> b = makeRandomPoints(random, 20, 1);
  FeatureCache cache;
  for (int step = 0; step < 400; ++step) {
    const Vec3 at{4.0 - 0.02 * step, 0.3, 0.2};
    const SeparationResult warm = computeSeparation({a, at}, {b, Vec3::Zero()}, cache);
    const SeparationResult cold = computeSeparationCold({a, at}, {b, Vec3::Zero()});
    ASSERT_EQ(warm.verdict, cold.verdict) << "step " << step;
    EXPECT_NEAR(warm.distance, cold.distance, 1e-13) << "step " << step;
  }
}

}  // namespace
}  // namespace enfilade::collision
