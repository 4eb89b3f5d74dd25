#include "collision/shapes/hull.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <stdexcept>

#include "collision/shapes/exact_orientation.hpp"

namespace enfilade::collision {
namespace {

using Points = std::vector<Vec3>;

void expectSame(const Hull& a, const Hull& b) {
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.faces, b.faces);
  EXPECT_EQ(a.neighbours, b.neighbours);
}

/// Every point is inside of every face of a solid, exactly.
void expectInside(const Hull& hull, const Points& points) {
  for (const auto& face : hull.faces) {
    for (const Vec3& p : points) {
      ASSERT_LE(orient3d(hull.vertices[face[0]], hull.vertices[face[1]], hull.vertices[face[2]], p),
                0);
    }
  }
}

Points makeBoxCorners(const Vec3& low, const Vec3& high) {
  Points corners;
  for (int k = 0; k < 8; ++k) {
    corners.emplace_back((k & 1) != 0 ? high.x() : low.x(), (k & 2) != 0 ? high.y() : low.y(),
                         (k & 4) != 0 ? high.z() : low.z());
  }
  return corners;
}

Points makeIntegerPoints(std::mt19937& random, std::size_t count, int size) {
  std::uniform_int_distribution<int> coordinate(0, size);
  Points points;
  for (std::size_t k = 0; k < count; ++k) {
    const int x = coordinate(random), y = coordinate(random), z = coordinate(random);
    points.emplace_back(x, y, z);
  }
  return points;
}

Points makeRealPoints(std::mt19937& random, std::size_t count, double scale) {
  std::uniform_real_distribution<double> coordinate(-scale, scale);
  Points points;
  for (std::size_t k = 0; k < count; ++k) {
    const double x = coordinate(random), y = coordinate(random), z = coordinate(random);
    points.emplace_back(x, y, z);
  }
  return points;
}

TEST(Hull, OfABoxHasSixQuadsWhateverElseLiesOnIt) {
  Points points;
  for (int x = 0; x <= 4; ++x) {
    for (int y = 0; y <= 4; ++y) {
      for (int z = 0; z <= 4; ++z) points.emplace_back(0.1 * x, 0.1 * y, 0.1 * z);
    }
  }
  const Hull hull = buildHull(points);
  validateHull(hull);
  EXPECT_EQ(hull.vertices.size(), 8u);
  ASSERT_EQ(hull.faces.size(), 6u);
  for (const auto& face : hull.faces) EXPECT_EQ(face.size(), 4u);
  for (std::uint32_t v = 0; v < 8; ++v) EXPECT_EQ(hull.getNeighbours(v).size(), 3u);
  expectInside(hull, points);
}

TEST(Hull, OfAPrismHasTwoCapsAndAQuadASide) {
  // Corners of an octagon with integer coordinates, so that caps and sides are exactly flat.
  const std::vector<std::pair<int, int>> octagon{{3, 1},   {1, 3},   {-1, 3}, {-3, 1},
                                                 {-3, -1}, {-1, -3}, {1, -3}, {3, -1}};
  Points points;
  for (const auto& [x, z] : octagon) {
    points.emplace_back(x, 0, z);
    points.emplace_back(x, 5, z);
    points.emplace_back(x, 2, z);  // within an edge
  }
  const Hull hull = buildHull(points);
  validateHull(hull);
  EXPECT_EQ(hull.vertices.size(), 16u);
  EXPECT_EQ(hull.faces.size(), 10u);
  EXPECT_EQ(std::count_if(hull.faces.begin(), hull.faces.end(),
                          [](const auto& face) { return face.size() == 8; }),
            2);
}

TEST(Hull, OfOnePointOrASegmentOrAPolygonIsFlat) {
  const Hull point = buildHull(Points{{1, 2, 3}, {1, 2, 3}});
  validateHull(point);
  EXPECT_EQ(point.vertices.size(), 1u);
  EXPECT_TRUE(point.faces.empty());
  EXPECT_TRUE(point.getNeighbours(0).empty());

  const Hull segment = buildHull(Points{{1, 1, 1}, {0, 0, 0}, {3, 3, 3}, {2, 2, 2}});
  validateHull(segment);
  EXPECT_EQ(segment.vertices, (Points{{0, 0, 0}, {3, 3, 3}}));
  EXPECT_EQ(segment.getNeighbours(0).size(), 1u);

  for (int flat = 0; flat < 3; ++flat) {
    Points points;
    for (int a = 0; a <= 3; ++a) {
      for (int b = 0; b <= 3; ++b) {
        Vec3 p(a, b, a + b);  // a plane that is parallel to no axis, and two that are
        if (flat < 2) p[flat] = 7;
        points.push_back(p);
      }
    }
    const Hull polygon = buildHull(points);
    validateHull(polygon);
    EXPECT_EQ(polygon.faces.size(), 2u);
    EXPECT_EQ(polygon.vertices.size(), 4u);
  }
}

TEST(Hull, FacesRunAnticlockwiseSeenFromOutside) {
  const Hull hull = buildHull(makeBoxCorners({-1, -2, -3}, {1, 2, 3}));
  for (const auto& face : hull.faces) {
    const Vec3& a = hull.vertices[face[0]];
    const Vec3 normal = (hull.vertices[face[1]] - a).cross(hull.vertices[face[2]] - a);
    EXPECT_GT(normal.dot(a), 0);
  }
}

TEST(Hull, OfLatticePointsIsRightWithManyTies) {
  std::mt19937 random(2);
  int solids = 0, flats = 0;
  for (int scene = 0; scene < 400; ++scene) {
    const Points points =
        makeIntegerPoints(random, 3 + static_cast<std::size_t>(scene) % 40, 1 + scene % 4);
    const Hull hull = buildHull(points);
    ASSERT_NO_THROW(validateHull(hull)) << "scene " << scene;
    expectInside(hull, points);
    (hull.faces.size() >= 4 ? solids : flats) += 1;
  }
  EXPECT_GT(solids, 300);
  EXPECT_GT(flats, 5);
}

TEST(Hull, OfPointsNearlyOnAPlaneIsRight) {
  std::mt19937 random(3);
  for (int scene = 0; scene < 60; ++scene) {
    Points points = makeRealPoints(random, 60, 1.0);
    // z = x + y rounded: coplanar up to an ulp, so a solid a few 1e-17 thick
    for (Vec3& p : points) p.z() = p.x() + p.y();
    const Hull hull = buildHull(points);
    ASSERT_NO_THROW(validateHull(hull)) << "scene " << scene;
    expectInside(hull, points);
  }
}

TEST(Hull, OfPointsOnASphereKeepsThemAll) {
  std::mt19937 random(4);
  Points points = makeRealPoints(random, 300, 1.0);
  for (Vec3& p : points) p.normalize();
  const Hull hull = buildHull(points);
  ASSERT_NO_THROW(validateHull(hull));
  EXPECT_EQ(hull.vertices.size(), 300u);
  EXPECT_EQ(hull.faces.size(), 596u);  // 2V - 4 triangles
  EXPECT_NEAR(hull.radius, 1.0, 1e-15);
}

TEST(Hull, DoesNotDependOnTheOrderOfThePoints) {
  std::mt19937 random(5);
  for (int scene = 0; scene < 100; ++scene) {
    Points points =
        scene % 2 == 0 ? makeIntegerPoints(random, 30, 3) : makeRealPoints(random, 30, 10.0);
    const Hull hull = buildHull(points);
    std::shuffle(points.begin(), points.end(), random);
    points.push_back(points.front());
    expectSame(hull, buildHull(points));
  }
}

TEST(Hull, OfItsOwnVerticesIsItself) {
  std::mt19937 random(6);
  for (int scene = 0; scene < 50; ++scene) {
    const Hull hull = buildHull(makeIntegerPoints(random, 50, 5));
    expectSame(hull, buildHull(hull.vertices));
  }
}

TEST(Hull, AcceptsHugeAndTinyCoordinates) {
  for (const double scale : {1e-300, 1e-160, 1e100, 1e300}) {
    Points points = makeBoxCorners({-1, -1, -1}, {1, 1, 1});
    points.emplace_back(0, 0, 0);
    points.emplace_back(1, 0.5, 0.25);
    for (Vec3& p : points) p *= scale;
    const Hull hull = buildHull(points);
    EXPECT_EQ(hull.vertices.size(), 8u) << scale;
    EXPECT_EQ(hull.faces.size(), 6u) << scale;
  }
}

TEST(Hull, RefusesNoPointsAndPointsThatAreNotFinite) {
  EXPECT_THROW(buildHull(Points{}), std::invalid_argument);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(buildHull(Points{{0, 0, 0}, {0, nan, 0}}), std::invalid_argument);
}

TEST(Hull, ValidateFindsEachDefect) {
  const Hull sound = buildHull(makeBoxCorners({0, 0, 0}, {1, 1, 1}));
  Hull hull = sound;
  hull.faces.pop_back();
  EXPECT_THROW(validateHull(hull), std::logic_error);
  hull = sound;
  hull.vertices[0] = Vec3(0.5, 0.5, 0.5);
  EXPECT_THROW(validateHull(hull), std::logic_error);
  hull = sound;
  std::reverse(hull.faces[0].begin(), hull.faces[0].end());
  EXPECT_THROW(validateHull(hull), std::logic_error);
  hull = sound;
  std::swap(hull.neighbours[0], hull.neighbours[1]);
  EXPECT_THROW(validateHull(hull), std::logic_error);
  hull = sound;
  hull.radius *= 2;
  EXPECT_THROW(validateHull(hull), std::logic_error);
}

TEST(Orientation, IsExactWhereDoublesAreNot) {
  const Vec3 a(0.5, 0.5, 0.5), b(12, 12, 12), c(24, 25, 24);
  const double step = 0x1p-53;
  EXPECT_EQ(orient3d(a, b, c, Vec3(0.5, 3, 0.5)), 0);
  EXPECT_EQ(orient3d(a, b, c, Vec3(0.5, 3, 0.5 + step)), orient3d(a, b, c, Vec3(0.5, 3, 1.5)));
  EXPECT_EQ(orient3d(a, b, c, Vec3(0.5, 3, 0.5 - step)), orient3d(a, b, c, Vec3(0.5, 3, -1.5)));
  EXPECT_NE(orient3d(a, b, c, Vec3(0.5, 3, 1.5)), 0);
}

}  // namespace
}  // namespace enfilade::collision
