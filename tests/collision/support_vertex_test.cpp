// The certificates of support vertices, compared with projections in rationals.
#include <gmpxx.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/minkowski/minkowski.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using testing::drawUniform;
using testing::Random;

/// direction . (rotation * vertex) of all vertices, exactly.
std::vector<mpq_class> projectExactly(const PlacedConvex& body, const Vec3& direction) {
  std::array<mpq_class, 3> local;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      local[j] += mpq_class(direction[i]) * mpq_class((*body.rotation)(i, j));
  std::vector<mpq_class> projections;
  for (const Vec3& p : body.vertices)
    projections.emplace_back(local[0] * mpq_class(p.x()) + local[1] * mpq_class(p.y()) +
                             local[2] * mpq_class(p.z()));
  return projections;
}

/// Solid bodies with few and many vertices, flat ones, and boxes, whose faces tie four vertices.
Hull makeHull(Random& random, int kind) {
  std::vector<Vec3> points;
  if (kind % 4 == 0) points = testing::makeLatticePoints(random, 12, 1);
  if (kind % 4 == 1) points = testing::makeRandomPoints(random, 7, 1);
  if (kind % 4 == 2)
    for (int i = 0; i < 60; ++i) points.push_back(testing::makeRandomPoint(random, 1).normalized());
  if (kind % 4 == 3) {
    points = testing::makeRandomPoints(random, 9, 1);
    for (Vec3& p : points) p.z() = 0;
  }
  return buildHull(points);
}

/// Any direction, or one that ties the corners of a face or of two neighbours up to rounding.
Vec3 makeDirection(Random& random, const PlacedConvex& body, int kind) {
  const auto corner = [&](std::size_t k) -> const Vec3& {
    const auto& faces = body.hull->faces;
    if (faces.empty()) return body.vertices[k % body.vertices.size()];
    const auto& face = faces[static_cast<std::size_t>(kind) % faces.size()];
    return body.vertices[face[k % face.size()]];
  };
  const Vec3 any = testing::makeRandomPoint(random, 1), edge = corner(1) - corner(0);
  Vec3 local = kind % 3 == 0 ? any : edge.cross(kind % 3 == 1 ? corner(2) - corner(0) : any);
  if (kind % 2 == 0) local += any * std::ldexp(local.norm(), -50 - kind % 7);
  return (*body.rotation * local).stableNormalized();
}

/// Whether the vertices visited contain one that is farthest exactly.
struct Visited {
  const std::vector<mpq_class>& projections;
  const mpq_class& farthest;
  bool complete = false;
  void operator()(std::uint32_t i) { complete = complete || projections[i] == farthest; }
};

/// Checks one support vertex; returns whether it claims to be the only farthest one.
bool checkSupport(const BoundedConvex& convex, const Vec3& direction,
                  const SupportVertex& support) {
  const std::vector<mpq_class> projections = projectExactly(*convex.shape, direction);
  const mpq_class& farthest = *std::max_element(projections.begin(), projections.end());
  if (support.unique) {
    EXPECT_EQ(projections[support.vertex], farthest);
    EXPECT_EQ(std::count(projections.begin(), projections.end(), farthest), 1);
  }
  Visited candidates{projections, farthest}, values{projections, farthest};
  forEachSupportCandidate(convex, support, [&](std::uint32_t i) { candidates(i); });
  forEachSupportValue(convex, support, [&](std::uint32_t i) { values(i); });
  EXPECT_TRUE(candidates.complete);
  EXPECT_TRUE(values.complete);
  return support.unique;
}

TEST(SupportVertex, ClaimsToBeTheFarthestOnlyIfItIs) {
  Random random(11);
  int unique = 0, tied = 0;
  for (int i = 0; i < 2000; ++i) {
    SCOPED_TRACE(i);
    const Hull hullA = makeHull(random, i), hullB = makeHull(random, i / 4);
    const Vec3 axis = testing::makeRandomPoint(random, 1).stableNormalized();
    const Mat3 turned = Eigen::AngleAxisd(drawUniform(random, 0, 6), axis).toRotationMatrix();
    const Mat3 sheared = turned + 1e-9 * Mat3::Ones();
    const bool withHull = i % 5 != 0;
    const PlacedConvex a{hullA.vertices, Vec3::Zero(), &turned, &hullA},
        b{hullB.vertices, Vec3(3, 4, 5), &sheared, withHull ? &hullB : nullptr};
    const Vec3 direction = makeDirection(random, a, i);
    if (direction.isZero(0)) continue;
    const MinkowskiDifference difference(a, b);
    const double length = computeNorm(direction) * kMaxUnitLength;
    const SupportPair supports = hillClimbPair(difference, direction, length, {});
    for (const bool claims : {checkSupport(difference.a, direction, supports.a),
                              checkSupport(difference.b, -direction, supports.b)})
      ++(claims ? unique : tied);
  }
  EXPECT_GT(unique, 1000);
  EXPECT_GT(tied, 500);
}

TEST(SupportVertex, ScansTwoVerticesAtOnceAsOneByOne) {
  Random random(12);
  for (std::size_t count = 1; count <= kMaxScannedVertices; ++count) {
    SCOPED_TRACE(count);
    const auto vertices = testing::makeRandomPoints(random, static_cast<int>(count), 1);
    const Vec3 direction = testing::makeRandomPoint(random, 1);
    for (const Vec3& limit : vertices) {
      const double threshold = dot(direction, limit);
      const std::uint64_t above = findVerticesAbove(vertices, direction, threshold);
      std::uint64_t expected = 0;
      for (std::size_t i = 0; i < count; ++i)
        if (dot(direction, vertices[i]) >= threshold) expected |= std::uint64_t{1} << i;
      EXPECT_EQ(above, expected);
    }
  }
}

}  // namespace
}  // namespace enfilade::collision
