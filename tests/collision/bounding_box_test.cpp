#include "collision/bounds/bounding_box.hpp"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace enfilade::collision {
namespace {

Hull makeRandomHull(std::mt19937& random, std::size_t points) {
  std::uniform_real_distribution<double> coordinate(-1, 1);
  std::vector<Vec3> cloud;
  for (std::size_t k = 0; k < points; ++k) {
    const double x = coordinate(random), y = coordinate(random), z = coordinate(random);
    cloud.emplace_back(x, 0.3 * y, z);
  }
  return buildHull(cloud);
}

Pose makeRandomPose(std::mt19937& random, double reach) {
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

/// The same by the rounded matrix of the quaternion.
Rationals transformByMatrix(const Pose& pose, const Vec3& vertex) {
  const Mat3 rotation = pose.rotation.toRotationMatrix();
  Rationals result;
  for (int axis = 0; axis < 3; ++axis) {
    mpq_class& sum = result[static_cast<std::size_t>(axis)];
    sum = pose.translation[axis];
    for (int k = 0; k < 3; ++k) sum += mpq_class(rotation(axis, k)) * vertex[k];
  }
  return result;
}

void expectContains(const Aabb& box, const Hull& hull, const Pose& pose, double clearance = 0) {
  for (const Vec3& vertex : hull.vertices) {
    for (const Rationals& exact :
         {transformExactly(pose, vertex), transformByMatrix(pose, vertex)}) {
      for (int axis = 0; axis < 3; ++axis) {
        const mpq_class& coordinate = exact[static_cast<std::size_t>(axis)];
        ASSERT_TRUE(box.min[axis] <= coordinate - clearance &&
                    coordinate + clearance <= box.max[axis])
            << "axis " << axis << " of vertex " << vertex.transpose();
      }
    }
  }
}

/// A hull with its support table for one method, and the extremal vertices of the last box.
struct Turning {
  const Hull& hull;
  SupportTable support;
  ExtremalVertices last = {};
  std::uint64_t looked = 0;

  /// Of hill climbing: climbs after each turn.
  Turning(const Hull& h, AabbMethod method) : hull(h), support(buildSupportTable(h, method)) {
    support.minTurnTrace = -std::numeric_limits<double>::infinity();
  }
  Aabb computeBox(const Pose& pose, double clearance = 0) {
    return computeAabb(hull, support, pose.rotation.toRotationMatrix(), pose.translation, last,
                       looked, clearance);
  }
};

Aabb computeScannedBox(const Hull& hull, const Pose& pose, double clearance = 0) {
  return computeTightAabb(hull, pose.rotation.toRotationMatrix(), pose.translation, clearance);
}

void expectSame(const Aabb& a, const Aabb& b) {
  EXPECT_EQ(a.min, b.min);
  EXPECT_EQ(a.max, b.max);
}

Quat rotateBy(const Quat& rotation, const Vec3& half) {
  return (Quat(1, half.x(), half.y(), half.z()) * rotation).normalized();
}

TEST(HillClimb, GivesTheBoxOfTheScanToTheLastBitAndContainsTheExactOne) {
  std::mt19937 random(11);
  for (int body = 0; body < 40; ++body) {
    const Hull hull = makeRandomHull(random, 8 + 3 * static_cast<std::size_t>(body));
    Pose pose = makeRandomPose(random, body % 2 == 0 ? 10.0 : 1e6);
    Turning climbing(hull, AabbMethod::hillClimb);
    for (int tick = 0; tick < 20; ++tick) {
      pose.rotation = rotateBy(pose.rotation, Vec3(0.02, 0.03, -0.01));
      const Aabb box = climbing.computeBox(pose);
      expectContains(box, hull, pose);
      expectSame(box, computeScannedBox(hull, pose));
    }
  }
}

TEST(HillClimb, GivesTheSameBoxFromAnyStartAndFromIndicesOfAnotherHull) {
  std::mt19937 random(12);
  const Hull hull = makeRandomHull(random, 200);
  const Pose pose = makeRandomPose(random, 5.0);
  for (std::uint32_t start = 0; start < hull.vertices.size() + 3; ++start) {
    Turning climbing(hull, AabbMethod::hillClimb);
    climbing.last.vertex.fill(start);
    expectSame(climbing.computeBox(pose), computeScannedBox(hull, pose));
  }
}

TEST(HillClimb, IsNotFooledByATopThatRisesLessThanRoundingShows) {
  // A disc of 200 corners, almost edge-on: adjacent corners differ by less than an ulp in height,
  // the ends by many ulps.
  std::vector<Vec3> corners;
  for (int k = 0; k < 100; ++k) {
    const double t = 0.01 * k - 0.5;
    corners.emplace_back(t, 1 - t * t, 0);
    corners.emplace_back(t, -1 + t * t, 0);
  }
  const Hull hull = buildHull(corners);
  for (const double tilt : {0.0, 1e-19, 1e-17, 1e-16, 3e-16, 1e-15, 1e-14}) {
    const Pose pose{Quat(1, tilt, -tilt, 0), Vec3::Zero()};
    const Aabb scanned = computeScannedBox(hull, pose);
    expectContains(scanned, hull, pose);
    for (std::uint32_t start = 0; start < hull.vertices.size(); start += 7) {
      Turning climbing(hull, AabbMethod::hillClimb);
      climbing.last.vertex.fill(start);
      expectSame(climbing.computeBox(pose), scanned);
    }
  }
}

TEST(HillClimb, HoldsForVerticesThatWereMovedByRoundingSinceTheHullWasBuilt) {
  // As in a rigid body, whose frame moves to the centre of mass: corners of regular prisms, whose
  // faces are no longer quite flat.
  std::mt19937 random(20);
  for (int sides = 3; sides < 60; ++sides) {
    std::vector<Vec3> corners;
    for (int k = 0; k < sides; ++k) {
      const double angle = 6.283185307179586 * k / sides;
      for (const double height : {0.1, 0.7})
        corners.emplace_back(0.3 * std::cos(angle), height, 0.3 * std::sin(angle));
    }
    Hull hull = buildHull(corners);
    hull.radius = 0;
    for (Vec3& vertex : hull.vertices) {
      vertex -= Vec3(0.1 / 3, 0.4, -0.7 / 9);
      hull.radius = std::max(hull.radius, vertex.norm());
    }
    const Quat random1 = makeRandomPose(random, 1).rotation;
    for (const Quat& rotation : {Quat::Identity(), Quat(1, 1, 0, 0).normalized(),
                                 Quat(1, 0, 1, 0).normalized(), random1}) {
      const Pose pose{rotation, Vec3(1, 2, 3)};
      for (std::uint32_t start = 0; start < hull.vertices.size(); start += 5) {
        Turning climbing(hull, AabbMethod::hillClimb);
        climbing.last.vertex.fill(start);
        expectSame(climbing.computeBox(pose), computeScannedBox(hull, pose));
      }
    }
  }
}

TEST(HillClimb, LooksAtFewVerticesOfABodyThatTurnsSlowly) {
  std::mt19937 random(13);
  std::vector<Vec3> points;
  std::normal_distribution<double> normal;
  for (int k = 0; k < 500; ++k) {
    const double x = normal(random), y = normal(random), z = normal(random);
    points.push_back(Vec3(x, y, z).normalized());
  }
  const Hull hull = buildHull(points);
  Turning climbing(hull, AabbMethod::hillClimb);
  Pose pose = makeRandomPose(random, 5.0);
  climbing.computeBox(pose);
  climbing.looked = 0;
  const ExtremalVertices before = climbing.last;
  pose.translation += Vec3(1, 2, 3);
  climbing.computeBox(pose);
  EXPECT_EQ(before.vertex, climbing.last.vertex);
  for (int tick = 0; tick < 50; ++tick) {
    pose.rotation = rotateBy(pose.rotation, Vec3(0.01, 0.01, -0.01));
    climbing.computeBox(pose);
  }
  EXPECT_LT(climbing.looked / 51, 100u);
}

TEST(TightBox, OfFlatHullsIsRight) {
  std::mt19937 random(14);
  const std::vector<std::vector<Vec3>> flats{
      {{0.3, 0.1, 0.2}}, {{0, 0, 0}, {1, 2, 3}}, {{0, 0, 0}, {1, 0, 1}, {0, 1, 1}, {1, 1, 2}}};
  for (const auto& points : flats) {
    const Hull hull = buildHull(points);
    Turning climbing(hull, AabbMethod::hillClimb);
    for (int k = 0; k < 50; ++k) {
      const Pose pose = makeRandomPose(random, 3.0);
      const Aabb box = climbing.computeBox(pose);
      expectContains(box, hull, pose);
      expectSame(box, computeScannedBox(hull, pose));
    }
  }
}

TEST(SphereCube, ContainsTheBodyInEveryAttitude) {
  std::mt19937 random(15);
  const Hull hull = makeRandomHull(random, 30);
  Turning cube(hull, AabbMethod::sphereCube);
  for (int k = 0; k < 100; ++k) {
    const Pose pose = makeRandomPose(random, 100.0);
    expectContains(cube.computeBox(pose), hull, pose);
    EXPECT_NEAR(cube.computeBox(pose).size().x(), 2 * hull.radius, 1e-12);
  }
  EXPECT_EQ(cube.looked, 0u);
}

TEST(BoxesWithClearance, HoldTheExactBoxGrownByItWhateverTheSizes) {
  std::mt19937 random(16);
  int rounded = 0;
  for (int body = 0; body < 60; ++body) {
    const Hull hull = makeRandomHull(random, 12);
    const Pose pose = makeRandomPose(random, std::ldexp(1.0, 5 * (body % 8)));
    const double clearance = std::ldexp(0.7, body % 50 - 40);
    for (const AabbMethod method :
         {AabbMethod::sphereCube, AabbMethod::vertexScan, AabbMethod::hillClimb})
      expectContains(Turning(hull, method).computeBox(pose, clearance), hull, pose, clearance);
    const Aabb box = computeScannedBox(hull, pose, clearance),
               tight = computeScannedBox(hull, pose);
    const double slack = 0x1p-44 * (hull.radius + pose.translation.norm() + clearance);
    EXPECT_LE((box.max - tight.max).maxCoeff(), clearance + slack);
    // Adding the clearance to the tight box with rounding to nearest is not sufficient.
    rounded += contains(inflate(tight, clearance), box) ? 0 : 1;
  }
  EXPECT_GT(rounded, 10);
}

Hull makeEllipsoid(std::mt19937& random, int vertices, const Vec3& halfAxes) {
  std::normal_distribution<double> normal;
  std::vector<Vec3> points;
  for (int k = 0; k < vertices; ++k) {
    const double x = normal(random), y = normal(random), z = normal(random);
    points.push_back(Vec3(x, y, z).normalized().cwiseProduct(halfAxes));
  }
  return buildHull(points);
}

TEST(HillClimb, ScansAfterALargeTurnAlone) {
  std::mt19937 random(19);
  const Hull hull = makeEllipsoid(random, 60, Vec3(0.2, 0.15, 0.1));
  const SupportTable support = buildSupportTable(hull, AabbMethod::hillClimb);
  ExtremalVertices last;
  Pose pose = makeRandomPose(random, 5.0);
  const auto countLooked = [&](double turn) {
    pose.rotation = rotateBy(pose.rotation, Vec3(0, turn / 2, 0));
    std::uint64_t looked = 0;
    expectSame(computeAabb(hull, support, pose.rotation.toRotationMatrix(), pose.translation, last,
                           looked),
               computeScannedBox(hull, pose));
    return looked;
  };
  countLooked(0);  // climbs from any vertex
  for (const double small : {0.01, 0.02}) EXPECT_LT(countLooked(small), hull.vertices.size());
  EXPECT_EQ(countLooked(0.4), hull.vertices.size());
  countLooked(0.01);  // climbs from where it was before the large turn
  EXPECT_LT(countLooked(0.01), hull.vertices.size());
}

TEST(AabbMethod, IsTheCubeForTheRoundTheScanForTheSmallTheClimbForTheLarge) {
  std::mt19937 random(18);
  EXPECT_EQ(chooseAabbMethod(makeEllipsoid(random, 1000, Vec3(0.25, 0.25, 0.25))),
            AabbMethod::sphereCube);
  EXPECT_EQ(chooseAabbMethod(makeEllipsoid(random, 8, Vec3(1, 0.1, 0.1))), AabbMethod::vertexScan);
  EXPECT_EQ(chooseAabbMethod(makeEllipsoid(random, 200, Vec3(1, 0.1, 0.1))), AabbMethod::hillClimb);
  std::vector<Vec3> moved = makeEllipsoid(random, 1000, Vec3(0.2, 0.2, 0.2)).vertices;
  for (Vec3& vertex : moved) vertex += Vec3(1, 0, 0);  // far from its own origin
  EXPECT_EQ(chooseAabbMethod(buildHull(moved)), AabbMethod::hillClimb);
}

}  // namespace
}  // namespace enfilade::collision
