#include "collision/compound/mesh_query.hpp"

#include <gtest/gtest.h>

#include "collision/narrow_phase/refine.hpp"
#include "tests/collision/moving_shapes.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

// ---- reference: every triangle, cold start -----------------------------------------------------

SeparationResult computeSeparationCold(const PlacedConvex& body, const Triangle& triangle) {
  FeatureCache cold;
  return computeSeparation(body, {std::span<const Vec3>(triangle)}, cold);
}

MeshContacts bruteForceContacts(const PlacedConvex& body, const TriangleTree& mesh) {
  MeshContacts contacts;
  for (std::uint32_t i = 0; i < mesh.triangles().size(); ++i) {
    const Verdict verdict = computeSeparationCold(body, mesh.triangles()[i]).verdict;
    if (verdict == Verdict::penetrating) contacts.penetrated.push_back(i);
    if (verdict == Verdict::touching) contacts.touched.push_back(i);
  }
  return contacts;
}

NearestTriangle bruteForceNearest(const PlacedConvex& body, const TriangleTree& mesh) {
  NearestTriangle nearest{0, computeSeparationCold(body, mesh.triangles()[0])};
  for (std::uint32_t i = 1; i < mesh.triangles().size(); ++i) {
    const SeparationResult separation = computeSeparationCold(body, mesh.triangles()[i]);
    if (separation.distance < nearest.separation.distance) nearest = {i, separation};
  }
  return nearest;
}

/// A hilly square of 2 n^2 triangles, `size` metres wide, on x and z.
TriangleTree hills(int n, double size, double height, Random& random) {
  std::vector<Vec3> points;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) {
      const double y = uniform(random, -height, height);
      points.emplace_back(size * i / n - size / 2, y, size * j / n - size / 2);
    }
  std::vector<Triangle> triangles;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Vec3 &a = points[i * (n + 1) + j], &b = points[(i + 1) * (n + 1) + j];
      const Vec3 &c = points[i * (n + 1) + j + 1], &d = points[(i + 1) * (n + 1) + j + 1];
      triangles.push_back({a, b, c});
      triangles.push_back({b, d, c});
    }
  return TriangleTree(triangles);
}

/// A hull that swings over the hills, sometimes into them.
struct Flight {
  Hull hull;
  Mat3 rotation = Mat3::Identity();
  Vec3 translation = Vec3::Zero();

  explicit Flight(Random& random) : hull(buildHull(randomPoints(random, 20, 0.5))) {}
  void moveTo(double t, double low, double high) {
    rotation = rotationAt(t, Vec3(0.3, 1, 0.2));
    translation = {wave(0.31 * t), low + (high - low) * (0.5 + 0.5 * wave(t)), wave(0.17 * t)};
  }
  PlacedConvex body() const { return {hull.vertices, translation, &rotation, &hull}; }
};

TEST(MeshQuery, ContactsAreThoseOfBruteForceOnTheWholeWay) {
  Random random(21);
  const TriangleTree mesh = hills(16, 4, 0.1, random);
  Flight flight(random);
  MeshCache cache;
  MeshContacts contacts;
  int clear = 0, inside = 0;
  for (int tick = 0; tick < 300; ++tick) {
    flight.moveTo(0.02 * tick, -0.1, 1.1);
    findMeshContacts(flight.body(), mesh, cache, contacts);
    const MeshContacts expected = bruteForceContacts(flight.body(), mesh);
    ASSERT_EQ(contacts.penetrated, expected.penetrated) << "tick " << tick;
    ASSERT_EQ(contacts.touched, expected.touched) << "tick " << tick;
    (expected.penetrated.empty() ? clear : inside) += 1;
  }
  EXPECT_GT(clear, 60);
  EXPECT_GT(inside, 60);
  EXPECT_LT(cache.broadUpdates, 100u);
  EXPECT_LT(cache.separationQueries, 300u * 40u);
}

TEST(MeshQuery, NearestIsThatOfBruteForceOnTheWholeWay) {
  Random random(22);
  const TriangleTree mesh = hills(16, 4, 0.1, random);
  Flight flight(random);
  MeshCache cache;
  int apart = 0;
  for (int tick = 0; tick < 300; ++tick) {
    flight.moveTo(0.02 * tick, 0.2, 2);
    const auto nearest = findNearestTriangle(flight.body(), mesh, cache);
    const NearestTriangle expected = bruteForceNearest(flight.body(), mesh);
    ASSERT_TRUE(nearest);
    const double tolerance = nearest->separation.errorBound + expected.separation.errorBound;
    ASSERT_NEAR(nearest->separation.distance, expected.separation.distance, tolerance);
    const SeparationResult again =
        computeSeparationCold(flight.body(), mesh.triangles()[nearest->triangle]);
    ASSERT_NEAR(again.distance, nearest->separation.distance, again.errorBound + tolerance);
    apart += expected.separation.verdict == Verdict::separated ? 1 : 0;
  }
  EXPECT_GT(apart, 100);
  EXPECT_LT(apart, 300);
  EXPECT_LT(cache.separationQueries, 300u * 40u);
}

TEST(MeshQuery, JumpsAndMixedQueriesAgreeWithBruteForce) {
  Random random(23);
  const TriangleTree mesh = hills(8, 4, 0.2, random);
  Flight flight(random);
  MeshCache cache;
  MeshContacts contacts;
  int nearer = 0;
  for (int query = 0; query < 200; ++query) {
    const double jump = query % 5 == 0 ? uniform(random, 0, 100) : 0.01 * query;
    flight.moveTo(jump, 0, 1.5);
    const NearestTriangle expected = bruteForceNearest(flight.body(), mesh);
    const double limit = uniform(random, 0, 1);
    const bool isNearer = expected.separation.distance < limit;
    EXPECT_EQ(isAnyTriangleWithin(flight.body(), mesh, limit, cache), isNearer);
    findMeshContacts(flight.body(), mesh, cache, contacts);
    EXPECT_EQ(contacts.penetrated, bruteForceContacts(flight.body(), mesh).penetrated);
    const auto nearest = findNearestTriangle(flight.body(), mesh, cache, limit);
    EXPECT_EQ(nearest.has_value(), isNearer);
    if (nearest) {
      EXPECT_NEAR(nearest->separation.distance, expected.separation.distance,
                  nearest->separation.errorBound + expected.separation.errorBound);
    }
    nearer += isNearer ? 1 : 0;
  }
  EXPECT_GT(nearer, 50);
  EXPECT_LT(nearer, 150);
}

TEST(MeshQuery, ABoxOnAFloorTouchesTheTrianglesUnderItAtEveryTick) {
  std::vector<Triangle> floor;
  for (int i = -4; i < 4; ++i)
    for (int j = -4; j < 4; ++j) {
      const double x = i, z = j;
      floor.push_back({Vec3(x, 0, z), Vec3(x + 1, 0, z), Vec3(x, 0, z + 1)});
      floor.push_back({Vec3(x + 1, 0, z), Vec3(x + 1, 0, z + 1), Vec3(x, 0, z + 1)});
    }
  const TriangleTree mesh(floor);
  const Hull box = buildHull(std::vector<Vec3>{{-.5, 0, -.5},
                                               {.5, 0, -.5},
                                               {-.5, 1, -.5},
                                               {.5, 1, -.5},
                                               {-.5, 0, .5},
                                               {.5, 0, .5},
                                               {-.5, 1, .5},
                                               {.5, 1, .5}});
  MeshCache cache;
  MeshContacts contacts;
  for (int tick = 0; tick < 64; ++tick) {
    const PlacedConvex body{box.vertices, Vec3(tick / 64.0, 0, 0.25), nullptr, &box};
    findMeshContacts(body, mesh, cache, contacts);
    EXPECT_TRUE(contacts.penetrated.empty());
    EXPECT_EQ(contacts.touched, bruteForceContacts(body, mesh).touched);
    EXPECT_GE(contacts.touched.size(), 4u);
  }
  const std::uint64_t separations = cache.separationQueries;
  const PlacedConvex body{box.vertices, Vec3(63 / 64.0, 0, 0.25), nullptr, &box};
  findMeshContacts(body, mesh, cache, contacts);
  EXPECT_GE(contacts.touched.size(), 4u);
  EXPECT_EQ(cache.separationQueries, separations) << "a query without motion costs nothing";
}

TEST(MeshQuery, AnEmptyMeshIsNowhere) {
  const TriangleTree mesh;
  const std::vector<Vec3> point{Vec3(1, 2, 3)};
  MeshCache cache;
  MeshContacts contacts;
  EXPECT_FALSE(findNearestTriangle({point}, mesh, cache));
  EXPECT_FALSE(isAnyTriangleWithin({point}, mesh, 1e9, cache));
  findMeshContacts({point}, mesh, cache, contacts);
  EXPECT_EQ(contacts.verdict(), Verdict::separated);
}

TEST(MeshQuery, ABodyInsideOfAClosedMeshIsSeparated) {
  const Hull room = buildHull(std::vector<Vec3>{{-2, -2, -2},
                                                {2, -2, -2},
                                                {-2, 2, -2},
                                                {2, 2, -2},
                                                {-2, -2, 2},
                                                {2, -2, 2},
                                                {-2, 2, 2},
                                                {2, 2, 2}});
  const TriangleTree mesh(boundary(room, Vec3::Zero()));
  const std::vector<Vec3> segment{Vec3(0, 0, 0), Vec3(1, 0, 0)};
  MeshCache cache;
  MeshContacts contacts;
  findMeshContacts({segment}, mesh, cache, contacts);
  EXPECT_EQ(contacts.verdict(), Verdict::separated);
  const auto nearest = findNearestTriangle({segment}, mesh, cache);
  ASSERT_TRUE(nearest);
  EXPECT_DOUBLE_EQ(nearest->separation.distance, 1);
}

TEST(HullPlanes, TheClearanceIsThatOfABallInside) {
  Random random(24);
  int found = 0;
  for (int i = 0; i < 200; ++i) {
    Flight flight(random);
    flight.moveTo(i, -1, 1);
    const HullPlanes planes(flight.hull);
    const Triangle triangle{flight.translation + randomPoint(random, 1),
                            flight.translation + randomPoint(random, 1),
                            flight.translation + randomPoint(random, 1)};
    const double clearance = computeInteriorClearance(planes, flight.body(), triangle);
    if (clearance == 0) continue;
    ++found;
    EXPECT_EQ(computeSeparationCold(flight.body(), triangle).verdict, Verdict::penetrating);
    // Moved by less, whatever the direction, they still penetrate.
    for (int k = 0; k < 8; ++k) {
      PlacedConvex moved = flight.body();
      moved.translation += 0.999 * clearance * randomPoint(random, 1).normalized();
      EXPECT_EQ(computeSeparationCold(moved, triangle).verdict, Verdict::penetrating);
    }
  }
  EXPECT_GT(found, 60);
  EXPECT_LT(found, 180);
}

}  // namespace
}  // namespace enfilade::collision
