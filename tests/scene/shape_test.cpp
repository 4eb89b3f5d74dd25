// Tests of shapes with known answers: closed, convex, winding.
#include "scene/model/shapes/shape.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "collision/shapes/exact_orientation.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene {
namespace {

using testing::buildBoxMesh;
using testing::buildMeshShape;
using testing::turnInsideOut;

void append(Mesh& to, const Mesh& from) {
  const auto first = static_cast<std::uint32_t>(to.positions.size());
  to.positions.insert(to.positions.end(), from.positions.begin(), from.positions.end());
  for (const std::uint32_t i : from.indices) to.indices.push_back(first + i);
}

/// Each triangle with its own vertices, as exporters write flat shading.
Mesh unweld(const Mesh& mesh) {
  Mesh apart;
  for (const std::uint32_t i : mesh.indices) {
    apart.indices.push_back(static_cast<std::uint32_t>(apart.positions.size()));
    apart.positions.push_back(mesh.positions[i]);
  }
  return apart;
}

/// Transforms in doubles, then rounds to floats.
Mesh turnMesh(const Mesh& mesh, std::mt19937& random, double reach) {
  std::uniform_real_distribution<double> number(-1, 1);
  const double w = number(random), x = number(random), y = number(random), z = number(random);
  const Eigen::Quaterniond turn = Eigen::Quaterniond(w, x, y, z).normalized();
  const double dx = reach * number(random), dy = reach * number(random),
               dz = reach * number(random);
  Mesh result = mesh;
  for (Eigen::Vector3f& p : result.positions)
    p = (turn * p.cast<double>() + Vec3(dx, dy, dz)).cast<float>();
  return result;
}

/// Two polygons of `sides` vertices, each a fan, with quads between them.
Mesh makePrismMesh(int sides, double radius, double height) {
  Mesh mesh;
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    for (const double y : {0.0, height})
      mesh.positions.push_back(
          Vec3(radius * std::cos(angle), y, -radius * std::sin(angle)).cast<float>());
  }
  const auto at = [&](int i, int top) { return static_cast<std::uint32_t>(2 * (i % sides) + top); };
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.indices.insert(mesh.indices.end(), {a, b, c});
  };
  for (int i = 0; i < sides; ++i) {
    add(at(i, 0), at(i + 1, 0), at(i + 1, 1));
    add(at(i, 0), at(i + 1, 1), at(i, 1));
    if (i < 2) continue;
    add(at(0, 1), at(i - 1, 1), at(i, 1));
    add(at(0, 0), at(i, 0), at(i - 1, 0));
  }
  return mesh;
}

TEST(Shape, ABoxIsOneConvexSolidHoweverItsCornersAreStored) {
  const Mesh box = buildBoxMesh({-1, 0, 2}, {3, 0.5, 7});
  for (const Mesh& mesh : {box, unweld(box)}) {
    const Shape shape = buildMeshShape(mesh);
    EXPECT_EQ(shape.vertices.size(), 8u);
    EXPECT_EQ(shape.triangles.size(), 12u);
    ASSERT_EQ(shape.shells.size(), 1u);
    EXPECT_EQ(shape.shells[0].kind, Shell::Kind::convex);
    EXPECT_FALSE(shape.shells[0].inward);
    EXPECT_EQ(shape.boundaryEdges + shape.nonManifoldEdges + shape.duplicate + shape.degenerate,
              0u);
  }
}

TEST(Shape, ABoxOfSeveralMeshesIsOneSolid) {
  const Mesh box = buildBoxMesh({0, 0, 0}, {1, 1, 1});
  Mesh sides = box, lid = box;
  lid.indices.assign(box.indices.begin(), box.indices.begin() + 6);
  sides.indices.assign(box.indices.begin() + 6, box.indices.end());
  const std::vector<Mesh> meshes{lid, buildBoxMesh({5, 5, 5}, {6, 6, 6}), sides};
  const std::vector<std::uint32_t> both{2, 0};
  const Shape shape = buildShape(meshes, both);
  ASSERT_EQ(shape.shells.size(), 1u);
  EXPECT_TRUE(shape.shells[0].isConvex());
  EXPECT_EQ(buildMeshShape(sides).shells[0].kind, Shell::Kind::open);
  EXPECT_EQ(buildMeshShape(sides).boundaryEdges, 4u);
}

TEST(Shape, TurnedBoxesAndPrismsAreConvexUpToTheRoundingOfTheirFloats) {
  std::mt19937 random(3);
  int exact = 0;
  for (int i = 0; i < 300; ++i) {
    const Mesh mesh = turnMesh(
        i % 2 ? buildBoxMesh({-4, 0, -0.1}, {4, 2.7, 0.1}) : makePrismMesh(3 + i % 60, 1, 2),
        random, i % 3 ? 500 : 0);
    const Shape shape = buildMeshShape(mesh);
    ASSERT_EQ(shape.shells.size(), 1u);
    EXPECT_TRUE(shape.shells[0].isConvex()) << i;
    EXPECT_FALSE(shape.shells[0].inward) << i;
    exact += shape.shells[0].kind == Shell::Kind::convex ? 1 : 0;
  }
  EXPECT_LT(exact, 100) << "rounding makes most of them non-planar";
}

TEST(Shape, ADentDeeperThanRoundingIsNotConvex) {
  // A dented box: its top is a pyramid whose apex lies `depth` units below it.
  for (const double depth : {0.0, 1e-7, 2e-6, 1e-4, 0.3}) {
    Mesh mesh = buildBoxMesh({0, 0, 0}, {1, 1, 1});
    mesh.indices.erase(mesh.indices.begin() + 18, mesh.indices.begin() + 24);  // the top
    mesh.positions.push_back(Vec3(0.5, 1 - depth, 0.5).cast<float>());
    for (const auto& [a, b] : {std::pair{2, 6}, {6, 7}, {7, 3}, {3, 2}})
      mesh.indices.insert(mesh.indices.end(), {8u, std::uint32_t(a), std::uint32_t(b)});
    const Shape shape = buildMeshShape(mesh);
    ASSERT_EQ(shape.shells.size(), 1u) << depth;
    const Shell::Kind expected = depth == 0     ? Shell::Kind::convex
                                 : depth < 3e-7 ? Shell::Kind::nearlyConvex
                                                : Shell::Kind::closed;
    EXPECT_EQ(shape.shells[0].kind, expected) << depth;
  }
}

TEST(Shape, SplitFacesAndPointsInsideOfFacesDoNoHarm) {
  // Each face of a box is a grid of 4 x 4 quads: most vertices are no corners of the hull.
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {0, 1}) {
      for (int i = 0; i < 16; ++i) {
        const auto corner = [&](int u, int v) {
          Eigen::Vector3f p;
          p[axis] = static_cast<float>(side);
          p[(axis + 1) % 3] = 0.25f * static_cast<float>(i % 4 + u);
          p[(axis + 2) % 3] = 0.25f * static_cast<float>(i / 4 + v);
          return p;
        };
        std::array quad{corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
        if (side == 0) std::reverse(quad.begin(), quad.end());
        for (const int k : {0, 1, 2, 0, 2, 3}) {
          mesh.indices.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
          mesh.positions.push_back(quad[k]);
        }
      }
    }
  }
  const Shape shape = buildMeshShape(mesh);
  ASSERT_EQ(shape.shells.size(), 1u);
  EXPECT_EQ(shape.shells[0].kind, Shell::Kind::convex);
  EXPECT_EQ(shape.vertices.size(), 98u);
}

TEST(Shape, TrianglesWithoutAreaAndRepeatedOnesAreCountedAndLeftOut) {
  Mesh mesh = buildBoxMesh({0, 0, 0}, {1, 2, 3});
  mesh.indices.insert(mesh.indices.end(), {0, 0, 1, 5, 5, 5});  // duplicate corners
  mesh.indices.insert(mesh.indices.end(), {3, 2, 0, 3, 1, 0});  // duplicates with rotated or
                                                                // reversed corners
  mesh.positions.emplace_back(0.5f, 0.0f, 0.0f);
  mesh.indices.insert(mesh.indices.end(), {0, 1, 8});  // collinear corners
  const Shape shape = buildMeshShape(mesh);
  EXPECT_EQ(shape.degenerate, 3u);
  EXPECT_EQ(shape.duplicate, 2u);
  EXPECT_EQ(shape.triangles.size(), 12u);
  EXPECT_EQ(shape.vertices.size(), 8u);
  EXPECT_TRUE(shape.shells.at(0).isConvex());
}

TEST(Shape, InsideOutSolidsAreRecognised) {
  const Shape shape = buildMeshShape(turnInsideOut(buildBoxMesh({0, 0, 0}, {1, 2, 3})));
  ASSERT_EQ(shape.shells.size(), 1u);
  EXPECT_TRUE(shape.shells[0].isConvex());
  EXPECT_TRUE(shape.shells[0].inward);
}

TEST(Shape, FacesWoundAgainstTheRestAreTurned) {
  Mesh mesh = buildBoxMesh({0, 0, 0}, {1, 2, 3});
  std::swap(mesh.indices[4], mesh.indices[5]);
  std::swap(mesh.indices[22], mesh.indices[23]);
  const Shape shape = buildMeshShape(mesh);
  EXPECT_EQ(shape.flippedTriangles, 2u);
  ASSERT_EQ(shape.shells.size(), 1u);
  EXPECT_EQ(shape.shells[0].kind, Shell::Kind::convex);
  EXPECT_FALSE(shape.shells[0].inward);
}

TEST(Shape, ACavityMakesTheSolidAroundItHollow) {
  Mesh mesh = buildBoxMesh({0, 0, 0}, {5, 3, 5});
  append(mesh, turnInsideOut(buildBoxMesh({0.2, 0.2, 0.2}, {4.8, 2.8, 4.8})));
  append(mesh, buildBoxMesh({10, 0, 0}, {11, 1, 1}));
  const Shape shape = buildMeshShape(mesh);
  ASSERT_EQ(shape.shells.size(), 3u);
  EXPECT_TRUE(shape.shells[0].hollow);
  EXPECT_TRUE(shape.shells[1].inward);
  EXPECT_FALSE(shape.shells[1].hollow);
  EXPECT_FALSE(shape.shells[2].hollow);
}

TEST(Shape, SolidsThatShareAnEdgeOrACornerAreNotOneSolid) {
  Mesh corner = buildBoxMesh({0, 0, 0}, {1, 1, 1});
  append(corner, buildBoxMesh({1, 1, 1}, {2, 2, 2}));
  const Shape two = buildMeshShape(corner);
  ASSERT_EQ(two.shells.size(), 2u);
  EXPECT_TRUE(two.shells[0].isConvex() && two.shells[1].isConvex());
  Mesh edge = buildBoxMesh({0, 0, 0}, {1, 1, 1});
  append(edge, buildBoxMesh({1, 1, 0}, {2, 2, 1}));
  const Shape crowded = buildMeshShape(edge);
  EXPECT_EQ(crowded.nonManifoldEdges, 1u);
  for (const Shell& shell : crowded.shells) EXPECT_FALSE(shell.isConvex());
}

TEST(Shape, ConcaveAndFlatSurfacesBoundNoConvexSolid) {
  Mesh stairs = buildBoxMesh({0, 0, 0}, {1, 1, 1});  // an L: two boxes in one outline
  stairs.positions.clear();
  stairs.indices.clear();
  const std::array<Vec3, 6> outline{Vec3{0, 0, 0}, {2, 0, 0}, {2, 1, 0},
                                    {1, 1, 0},     {1, 2, 0}, {0, 2, 0}};
  for (const Vec3& p : outline) {
    stairs.positions.push_back(p.cast<float>());
    stairs.positions.push_back((p + Vec3::UnitZ()).cast<float>());
  }
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % 6);
    stairs.indices.insert(stairs.indices.end(), {a, b, b + 1, a, b + 1, a + 1});
  }
  for (const auto& [a, b, c] : {std::array{0u, 1u, 2u}, {0u, 2u, 3u}, {0u, 3u, 4u}, {0u, 4u, 5u}}) {
    stairs.indices.insert(stairs.indices.end(), {2 * a, 2 * c, 2 * b});
    stairs.indices.insert(stairs.indices.end(), {2 * a + 1, 2 * b + 1, 2 * c + 1});
  }
  const Shape concave = buildMeshShape(stairs);
  ASSERT_EQ(concave.shells.size(), 1u);
  EXPECT_EQ(concave.shells[0].kind, Shell::Kind::closed);
  EXPECT_FALSE(concave.shells[0].inward);
  Mesh pillow;  // both sides of a square, split along different diagonals
  pillow.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  pillow.indices = {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2};
  EXPECT_FALSE(buildMeshShape(pillow).shells.at(0).isConvex());
}

}  // namespace
}  // namespace enfilade::scene
