#include "collision/bounds/bounding_box.hpp"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace enfilade::collision {
namespace {

Hull randomHull(std::mt19937& random, std::size_t points) {
  std::uniform_real_distribution<double> coordinate(-1, 1);
  std::vector<Vec3> cloud;
  for (std::size_t k = 0; k < points; ++k) {
    const double x = coordinate(random), y = coordinate(random), z = coordinate(random);
    cloud.emplace_back(x, 0.3 * y, z);
  }
  return buildHull(cloud);
}

Pose randomPose(std::mt19937& random, double reach) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> coordinate(-reach, reach);
  const double w = normal(random), i = normal(random), j = normal(random), k = normal(random);
  const double x = coordinate(random), y = coordinate(random), z = coordinate(random);
  return {Quat(w, i, j, k).normalized(), Vec3(x, y, z)};
}

using Rationals = std::array<mpq_class, 3>;

/// Transforms the vertex in exact arithmetic by the rotation of the normalised quaternion and by
/// the translation.
Rationals transformExactly(const Pose& pose, const Vec3& vertex) {
  const mpq_class w(pose.rotation.w()), x(pose.rotation.x()), y(pose.rotation.y()),
      z(pose.rotation.z());
  const mpq_class n = w * w + x * x + y * y + z * z;
  const std::array<Rationals, 3> rows{
      Rationals{n - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
      Rationals{2 * (x * y + w * z), n - 2 * (x * x + z * z), 2 * (y * z - w * x)},
      Rationals{2 * (x * z - w * y), 2 * (y * z + w * x), n - 2 * (x * x + y * y)}};
  Rationals result;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Rationals& row = rows[axis];
    result[axis] = (row[0] * vertex.x() + row[1] * vertex.y() + row[2] * vertex.z()) / n +
                   pose.translation[static_cast<int>(axis)];
  }
  return result;
}

void expectContains(const Aabb& box, const Hull& hull, const Pose& pose, double clearance = 0) {
  for (const Vec3& vertex : hull.vertices) {
    const Rationals exact = transformExactly(pose, vertex);
    for (int axis = 0; axis < 3; ++axis) {
      const mpq_class& coordinate = exact[static_cast<std::size_t>(axis)];
      ASSERT_TRUE(box.min[axis] <= coordinate - clearance &&
                  coordinate + clearance <= box.max[axis])
          << "axis " << axis << " of vertex " << vertex.transpose();
    }
  }
}

Quat rotateBy(const Quat& rotation, const Vec3& half) {
  return (Quat(1, half.x(), half.y(), half.z()) * rotation).normalized();
}

TEST(TightBox, ContainsTheExactBoxAndIsAsTightAsBruteForce) {
  std::mt19937 random(11);
  for (int body = 0; body < 40; ++body) {
    const Hull hull = randomHull(random, 8 + 3 * static_cast<std::size_t>(body));
    Pose pose = randomPose(random, body % 2 == 0 ? 10.0 : 1e6);
    ExtremalVertices last;
    for (int tick = 0; tick < 20; ++tick) {
      pose.rotation = rotateBy(pose.rotation, Vec3(0.02, 0.03, -0.01));
      const Aabb tight = tightAabb(hull, pose, last);
      expectContains(tight, hull, pose);
      const Aabb brute = tightAabbBruteForce(hull, pose);
      const double slack = 0x1p-44 * (hull.radius + pose.translation.norm());
      EXPECT_LE((tight.min - brute.min).cwiseAbs().maxCoeff(), slack);
      EXPECT_LE((tight.max - brute.max).cwiseAbs().maxCoeff(), slack);
    }
  }
}

TEST(TightBox, ClimbsFromAnyStartAndFromIndicesOfAnotherHull) {
  std::mt19937 random(12);
  const Hull hull = randomHull(random, 200);
  const Pose pose = randomPose(random, 5.0);
  const Aabb brute = tightAabbBruteForce(hull, pose);
  for (std::uint32_t start = 0; start < hull.vertices.size() + 3; ++start) {
    ExtremalVertices last;
    last.vertex.fill(start);
    const Aabb tight = tightAabb(hull, pose, last);
    EXPECT_EQ(tight.min, brute.min);
    EXPECT_EQ(tight.max, brute.max);
  }
}

TEST(TightBox, IsNotFooledByATopThatRisesLessThanRoundingShows) {
  // A disc of 200 corners, almost edge-on: adjacent corners differ by less than an ulp in height,
  // the ends by many ulps.
  std::vector<Vec3> corners;
  for (int k = 0; k < 100; ++k) {
    const double t = 0.01 * k - 0.5;
    corners.emplace_back(t, 1 - t * t, 0);
    corners.emplace_back(t, -1 + t * t, 0);
  }
  const Hull hull = buildHull(corners);
  for (const double tilt : {1e-19, 1e-17, 1e-16, 3e-16, 1e-15, 1e-14}) {
    const Pose pose{Quat(1, tilt, -tilt, 0), Vec3::Zero()};
    for (std::uint32_t start = 0; start < hull.vertices.size(); start += 7) {
      ExtremalVertices last;
      last.vertex.fill(start);
      expectContains(tightAabb(hull, pose, last), hull, pose);
    }
  }
}

TEST(TightBox, KeepsItsVerticesWhileTheBodyOnlyMoves) {
  std::mt19937 random(13);
  const Hull hull = randomHull(random, 50);
  Pose pose = randomPose(random, 5.0);
  ExtremalVertices last;
  tightAabb(hull, pose, last);
  const ExtremalVertices before = last;
  pose.translation += Vec3(1, 2, 3);
  tightAabb(hull, pose, last);
  EXPECT_EQ(before.vertex, last.vertex);
}

TEST(TightBox, OfFlatHullsIsRight) {
  std::mt19937 random(14);
  const std::vector<std::vector<Vec3>> flats{
      {{0.3, 0.1, 0.2}}, {{0, 0, 0}, {1, 2, 3}}, {{0, 0, 0}, {1, 0, 1}, {0, 1, 1}, {1, 1, 2}}};
  for (const auto& points : flats) {
    const Hull hull = buildHull(points);
    for (int k = 0; k < 50; ++k) {
      const Pose pose = randomPose(random, 3.0);
      ExtremalVertices last;
      expectContains(tightAabb(hull, pose, last), hull, pose);
    }
  }
}

TEST(FixedCube, ContainsTheBodyInEveryAttitude) {
  std::mt19937 random(15);
  const Hull hull = randomHull(random, 30);
  for (int k = 0; k < 100; ++k) {
    const Pose pose = randomPose(random, 100.0);
    const Aabb cube = boundingSphereCube(hull, pose);
    expectContains(cube, hull, pose);
    EXPECT_NEAR(cube.size().x(), 2 * hull.radius, 1e-12);
  }
}

TEST(BoxesWithClearance, HoldTheExactBoxGrownByItWhateverTheSizes) {
  std::mt19937 random(16);
  int rounded = 0;
  for (int body = 0; body < 60; ++body) {
    const Hull hull = randomHull(random, 12);
    const Pose pose = randomPose(random, std::ldexp(1.0, 5 * (body % 8)));
    const double clearance = std::ldexp(0.7, body % 50 - 40);
    ExtremalVertices climbed, walled;
    const std::vector<Aabb> boxes{tightAabb(hull, pose, climbed, clearance),
                                  tightAabbVoronoi(hull, pose, walled, clearance),
                                  boundingSphereCube(hull, pose, clearance)};
    for (const Aabb& box : boxes) expectContains(box, hull, pose, clearance);
    const double slack = 0x1p-44 * (hull.radius + pose.translation.norm() + clearance);
    const Aabb brute = tightAabbBruteForce(hull, pose);
    EXPECT_LE((boxes[0].max - brute.max).maxCoeff(), clearance + slack);
    // Adding the clearance to the tight box with rounding to nearest is not sufficient.
    rounded += contains(inflated(tightAabbBruteForce(hull, pose), clearance), boxes[0]) ? 0 : 1;
  }
  EXPECT_GT(rounded, 10);
}

TEST(TightBoxByVoronoi, IsTheBoxOfClimbingOverATumblingMotion) {
  std::mt19937 random(17);
  std::size_t changes = 0;
  for (int body = 0; body < 20; ++body) {
    const Hull hull = randomHull(random, 6 + 5 * static_cast<std::size_t>(body));
    Pose pose = randomPose(random, 10.0);
    ExtremalVertices climbed, walled;
    for (int tick = 0; tick < 40; ++tick) {
      pose.rotation = rotateBy(pose.rotation, Vec3(0.05, -0.03, 0.02));
      const ExtremalVertices before = walled;
      const Aabb box = tightAabbVoronoi(hull, pose, walled);
      expectContains(box, hull, pose);
      const Aabb brute = tightAabb(hull, pose, climbed);
      const double slack = 0x1p-44 * (hull.radius + pose.translation.norm());
      EXPECT_LE((box.min - brute.min).cwiseAbs().maxCoeff(), slack);
      EXPECT_LE((box.max - brute.max).cwiseAbs().maxCoeff(), slack);
      changes += before.vertex != walled.vertex ? 1 : 0;
    }
  }
  EXPECT_GT(changes, 200u);
}

TEST(TightBoxByVoronoi, IsNotSentAstrayByAStartInAnotherHullOrALevelTop) {
  std::vector<Vec3> corners;  // a disc that is almost edge-on, as above
  for (int k = 0; k < 60; ++k) {
    const double t = 0.02 * k - 0.6;
    corners.emplace_back(t, 1 - t * t, 0);
    corners.emplace_back(t, -1 + t * t, 0);
  }
  const Hull hull = buildHull(corners);
  for (const double tilt : {0.0, 1e-19, 1e-16, 1e-15, 1e-8, 0.3}) {
    const Pose pose{Quat(1, tilt, -tilt, 0).normalized(), Vec3::Zero()};
    for (std::uint32_t start = 0; start < hull.vertices.size() + 5; start += 3) {
      ExtremalVertices last;
      last.vertex.fill(start);
      expectContains(tightAabbVoronoi(hull, pose, last), hull, pose);
    }
  }
}

Hull ellipsoid(std::mt19937& random, const Vec3& halfAxes) {
  std::normal_distribution<double> normal;
  std::vector<Vec3> points;
  for (int k = 0; k < 40; ++k) {
    const double x = normal(random), y = normal(random), z = normal(random);
    points.push_back(Vec3(x, y, z).normalized().cwiseProduct(halfAxes));
  }
  return buildHull(points);
}

TEST(AabbMethod, IsTheCubeForTheSmallAndRoundAndTheTightBoxForTheOblongAmongMany) {
  std::mt19937 random(18);
  const Hull ball = ellipsoid(random, Vec3(0.25, 0.25, 0.25));
  const Hull rod = ellipsoid(random, Vec3(1, 0.1, 0.1));
  EXPECT_EQ(chooseAabbMethod(ball), AabbMethod::boundingSphereCube);
  EXPECT_EQ(chooseAabbMethod(rod), AabbMethod::tightAabb);
  const SceneDensity sparse{0.001, 0.45};  // Cohen et al. 1995: hardly any contacts
  EXPECT_EQ(chooseAabbMethod(rod, sparse), AabbMethod::boundingSphereCube);
  const SceneDensity crowded{1000, 0.05};
  EXPECT_EQ(chooseAabbMethod(ball, crowded), AabbMethod::tightAabb);
  const Pose pose = randomPose(random, 3);
  for (const AabbMethod method : {AabbMethod::boundingSphereCube, AabbMethod::tightAabb}) {
    ExtremalVertices last;
    expectContains(computeAabbWith(method, rod, pose, last, 0.125), rod, pose, 0.125);
  }
}

TEST(AabbMethod, KnowsABodyThatIsFarFromItsOwnOrigin) {
  std::mt19937 random(19);
  std::vector<Vec3> moved = ellipsoid(random, Vec3(0.2, 0.2, 0.2)).vertices;
  for (Vec3& vertex : moved) vertex += Vec3(1, 0, 0);
  EXPECT_EQ(chooseAabbMethod(buildHull(moved)), AabbMethod::tightAabb);
}

}  // namespace
}  // namespace enfilade::collision
