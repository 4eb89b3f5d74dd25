// Tests of collision geometry: each hull contains its triangles, and solids are solid.
#include "scene/model/shapes/collision_geometry.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "collision/shapes/exact_orientation.hpp"
#include "scene/world/world.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene {
namespace {

using testing::buildBoxMesh;
using testing::buildMeshShape;
using testing::turnInsideOut;

Eigen::Affine3d makeRandomPlacement(std::mt19937& random, bool mirror) {
  std::uniform_real_distribution<double> number(-1, 1);
  Eigen::Affine3d placed = Eigen::Affine3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) placed(row, column) = 10 * number(random);
  }
  if ((placed.linear().determinant() < 0) != mirror) placed.linear().col(0) *= -1;
  return placed;
}

TEST(CollisionGeometry, AHullHoldsEveryCornerOfItsSurfaceHoweverItIsPlaced) {
  std::mt19937 random(5);
  const Shape shape = buildMeshShape(buildBoxMesh({0, 0, 0}, {0.3, 2, 5}));
  for (int i = 0; i < 100; ++i) {
    const Eigen::Affine3d placed = makeRandomPlacement(random, i % 2 == 1);
    const CollisionGeometry parts = buildCollisionGeometry(shape, placed);
    ASSERT_EQ(parts.localHulls.size(), 1u);
    EXPECT_TRUE(parts.localTriangles.triangles().empty());
    for (const auto& face : parts.localHulls[0].faces) {
      const auto& v = parts.localHulls[0].vertices;
      for (const Eigen::Vector3f& p : shape.vertices) {
        EXPECT_LE(collision::orient3d(v[face[0]], v[face[1]], v[face[2]],
                                      placed * p.cast<double>() - parts.origin),
                  0);
      }
    }
  }
}

TEST(CollisionGeometry, QueriesEqualBruteForce) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> number(0, 20);
  Mesh mesh;
  for (int i = 0; i < 40; ++i) {  // every fourth lacks its last triangle and is therefore open
    const double x = number(random), y = number(random), z = number(random);
    Mesh box = buildBoxMesh({x, y, z}, {x + 1, y + 2, z + 1});
    if (i % 4 == 0) box.indices.resize(33);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), box.positions.begin(), box.positions.end());
    for (const std::uint32_t index : box.indices) mesh.indices.push_back(first + index);
  }
  const CollisionGeometry parts =
      buildCollisionGeometry(buildMeshShape(mesh), Eigen::Affine3d::Identity());
  EXPECT_EQ(parts.localHulls.size(), 30u);
  EXPECT_EQ(parts.localTriangles.triangles().size(), 110u);
  std::size_t hits = 0;
  for (int i = 0; i < 200; ++i) {
    const double x = number(random), y = number(random), z = number(random);
    const Aabb box{{x, y, z}, {x + 2, y + 1, z + 3}};
    std::vector<std::uint32_t> found, expected;
    parts.query(box, found);
    for (std::uint32_t part = 0; part < parts.size(); ++part) {
      Aabb own;
      const collision::PlacedConvex body = parts.convex(part);
      for (const Vec3& v : body.vertices) own.include(v + body.translation);
      EXPECT_EQ(own.min, parts.box(part).min);
      if (overlaps(own, box)) expected.push_back(part);
    }
    EXPECT_EQ(found, expected);
    hits += expected.size();
  }
  EXPECT_GT(hits, 80u);
}

TEST(CollisionGeometry, FarPartsAreStoredNearTheirOriginAndAreWhereTheyWere) {
  std::mt19937 random(7);
  const Mesh mesh = buildBoxMesh({0, 0, 0}, {0.3, 2, 5});
  Mesh open = mesh;
  open.indices.resize(33);
  const Shape shape = buildMeshShape(mesh), sheets = buildMeshShape(open);
  for (int i = 0; i < 100; ++i) {
    Eigen::Affine3d placed = makeRandomPlacement(random, false);
    placed.linear() *= 0.1;
    placed.translation() *= i % 4 ? 1000 : 1;
    std::vector<Vec3> expected, found;
    for (const Eigen::Vector3f& p : shape.vertices) expected.push_back(placed * p.cast<double>());
    const CollisionGeometry parts = buildCollisionGeometry(shape, placed);
    for (const Vec3& v : parts.localHulls.at(0).vertices) found.push_back(v + parts.origin);
    for (const Vec3& v : expected)
      EXPECT_EQ(std::count(found.begin(), found.end(), v), 1) << v.transpose();
    const CollisionGeometry rest = buildCollisionGeometry(sheets, placed);
    for (const collision::Triangle& t : rest.localTriangles.triangles()) {
      for (const Vec3& corner : t)
        EXPECT_EQ(std::count(expected.begin(), expected.end(), corner + rest.origin), 1);
    }
    if (placed.translation().cwiseAbs().minCoeff() > 100) {
      EXPECT_LT(parts.localHulls[0].radius, 12);
    }
  }
}

TEST(CollisionGeometry, InsideOutWallsAreSolidAndInsideOutRoomsAreRooms) {
  const Eigen::Affine3d as = Eigen::Affine3d::Identity();
  const Shape wall = buildMeshShape(turnInsideOut(buildBoxMesh({0, 0, 0}, {5, 3, 0.2})));
  EXPECT_EQ(buildCollisionGeometry(wall, as).localHulls.size(), 1u);
  const Shape room = buildMeshShape(turnInsideOut(buildBoxMesh({0, 0, 0}, {5, 3, 4})));
  EXPECT_EQ(buildCollisionGeometry(room, as).localHulls.size(), 0u);
  EXPECT_EQ(buildCollisionGeometry(room, as).localTriangles.triangles().size(), 12u);
  EXPECT_EQ(buildCollisionGeometry(room, Eigen::Affine3d(Eigen::Scaling(0.05))).localHulls.size(),
            1u);
}

/// The error of spawning an avatar at `at`; "" if it may enter there.
std::string findRefusalAt(const std::shared_ptr<const Scene>& scene, const Vec3& at) {
  World world(scene);
  submitAvatarCommand(world, {"ann", Spawn{at}, 0});
  const TickReport report = tickWorld(world);
  for (const Notice& notice : report.notices) {
    if (notice.kind == Notice::Kind::refused) return notice.text;
  }
  return "";
}

TEST(CollisionGeometry, AvatarsNeverEnterSolids) {
  // A convex block, a dented one, a mirrored one, and a vault with a room in it.
  Model model = testing::makeBoxModel({testing::makeFloorBox(), {"block", {2, 0, 2}, {6, 4, 6}}});
  Mesh dented = buildBoxMesh({-6, 0, 2}, {-2, 4, 6});
  dented.indices.erase(dented.indices.begin() + 18, dented.indices.begin() + 24);
  dented.positions.emplace_back(-4.0f, 3.5f, 4.0f);
  for (const auto& [a, b] : {std::pair{2, 6}, {6, 7}, {7, 3}, {3, 2}})
    dented.indices.insert(dented.indices.end(), {8u, std::uint32_t(a), std::uint32_t(b)});
  model.meshes.push_back(dented);
  model.objects.push_back({"dented", "", {2}, Eigen::Affine3d::Identity()});
  model.objects.push_back({"mirrored", "", {2}, Eigen::Affine3d(Eigen::Scaling(1.0, 1.0, -1.0))});
  Mesh vault = buildBoxMesh({2, 0, -8}, {8, 4, -2});
  const Mesh room = turnInsideOut(buildBoxMesh({2.5, 0.5, -7.5}, {7.5, 3.5, -2.5}));
  for (const std::uint32_t i : room.indices) vault.indices.push_back(8 + i);
  vault.positions.insert(vault.positions.end(), room.positions.begin(), room.positions.end());
  model.meshes.push_back(vault);
  model.objects.push_back({"vault", "", {3}, Eigen::Affine3d::Identity()});
  const auto scene = std::make_shared<const Scene>(std::move(model));

  EXPECT_EQ(findRefusalAt(scene, {0, 0, 0}), "");
  EXPECT_NE(findRefusalAt(scene, {4, 0.5, 4}).find("inside the solid block"), std::string::npos);
  EXPECT_NE(findRefusalAt(scene, {-4, 0.5, 4}).find("inside the solid dented"), std::string::npos);
  EXPECT_NE(findRefusalAt(scene, {-4, 0.5, -4}).find("inside the solid mirrored"),
            std::string::npos);
  EXPECT_EQ(findRefusalAt(scene, {5, 0.5, -5}), "");
}

}  // namespace
}  // namespace enfilade::scene
