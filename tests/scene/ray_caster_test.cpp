#include "scene/world/queries/ray_caster.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "scene/world/data/avatar_shape.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;

std::shared_ptr<const Scene> makeWallAndPane() {
  Model model = makeBoxModel(
      {makeFloorBox(), {"pane", {2, 0, -3}, {2.01, 3, 3}}, {"wall", {5, 0, -3}, {5.2, 3, 3}}});
  model.materials.emplace_back().alpha = Material::Alpha::blend;
  model.meshes[1].material = 1;
  return std::make_shared<const Scene>(std::move(model));
}

Snapshot makeSnapshotWithAvatarAt(const Vec3& footPosition) {
  Snapshot snapshot;
  AvatarSnapshot ann;
  ann.id = 100;
  ann.name = "ann";
  ann.footPosition = footPosition;
  ann.shape = makePrismShape(0.3, 1.75, 1.75, WorldSettings{});
  snapshot.avatars.push_back(ann);
  return snapshot;
}

TEST(RayCaster, ReportsFirstHitPointAndNormal) {
  const RayCaster caster(makeWallAndPane());
  const auto hit = caster.firstHit({{0, 1, 0}, {3, 0, 0}});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->entity, 2u);
  EXPECT_DOUBLE_EQ(hit->distance, 2);
  EXPECT_EQ(hit->point, Vec3(2, 1, 0));
  EXPECT_EQ(hit->normal, Vec3(-1, 0, 0));
}

TEST(RayCaster, IgnoresGlassIfRequested) {
  const RayCaster caster(makeWallAndPane());
  const auto hit = caster.firstHit({{0, 1, 0}, Vec3::UnitX()}, {0, true});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->entity, 3u);
  EXPECT_DOUBLE_EQ(hit->distance, 5);
}

TEST(RayCaster, EndsAtItsReach) {
  const RayCaster caster(makeWallAndPane());
  EXPECT_FALSE(caster.firstHit({{0, 1, 0}, Vec3::UnitX(), 1.999}));
  EXPECT_TRUE(caster.firstHit({{0, 1, 0}, Vec3::UnitX(), 2.0}));
  EXPECT_FALSE(caster.firstHit({{0, 1, 0}, -Vec3::UnitX()}));
  EXPECT_FALSE(caster.isBlocked({{0, 1, 0}, Vec3::UnitX(), 1.999}));
  EXPECT_TRUE(caster.isBlocked({{0, 1, 0}, Vec3::UnitX(), 2.5}));
}

TEST(RayCaster, SeesTheSurfaceThatItLooksAt) {
  const RayCaster caster(makeWallAndPane());
  const Ray toThePane{{0, 1, 0}, Vec3::UnitX(), 2.0};
  EXPECT_FALSE(caster.isBlocked(toThePane)) << "the query's own end does not block it";
}

TEST(RayCaster, HitsFlatGeometry) {
  Model model = makeBoxModel({makeFloorBox(), {"sheet", {2, 0, -3}, {3, 3, 3}}});
  model.objects[1].worldFromMesh.linear().row(0).setZero();  // flattens the object to x = 0
  model.objects[1].worldFromMesh.translation().x() = 2;
  const RayCaster caster(std::make_shared<const Scene>(std::move(model)));
  const auto hit = caster.firstHit({{0, 1, 0}, Vec3::UnitX()});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->entity, 2u);
  EXPECT_DOUBLE_EQ(hit->distance, 2);
}

TEST(RayCaster, MeetsAvatarsWhereTheyAreNow) {
  RayCaster caster(makeBoxScene({makeFloorBox()}));
  const Ray ray{{-5, 1, 0}, Vec3::UnitX()};
  EXPECT_FALSE(caster.firstHit(ray));
  caster.update(makeSnapshotWithAvatarAt({3, 0, 0}));
  const auto hit = caster.firstHit(ray);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->entity, 100u);
  EXPECT_NEAR(hit->distance, 7.7, 0.05);
  EXPECT_FALSE(caster.firstHit(ray, {100, false})) << "the querying avatar does not see itself";
  EXPECT_TRUE(caster.isBlocked(ray));
  EXPECT_FALSE(caster.isBlocked(ray, {100, false}));
  caster.update(makeSnapshotWithAvatarAt({3, 0, 4}));
  EXPECT_FALSE(caster.firstHit(ray));
  caster.update({});
  EXPECT_FALSE(caster.firstHit({{-5, 1, 4}, Vec3::UnitX()}));
}

TEST(RayCaster, MeetsADoorWhereItHasTurnedTo) {
  Model model = makeBoxModel({makeFloorBox(), {"door", {2, 0, 0}, {2.0625, 2, 1}}});
  model.bodies.push_back(makeBodySpec("door", BodyKind::hinged, {1}));
  model.bodies[0].anchor = {2, 0, 0};
  model.bodies[0].high = 2;
  RayCaster caster(std::make_shared<const Scene>(std::move(model)));
  const Ray atTheLeaf{{0, 1, 0.5}, Vec3::UnitX(), 5};
  EXPECT_FALSE(caster.firstHit(atTheLeaf)) << "not placed before update()";
  Snapshot snapshot;
  BodySnapshot door;
  door.id = 2;
  snapshot.bodies = std::make_shared<const std::vector<BodySnapshot>>(1, door);
  caster.update(snapshot);
  ASSERT_TRUE(caster.firstHit(atTheLeaf));
  EXPECT_EQ(caster.firstHit(atTheLeaf)->entity, 2u);
  EXPECT_DOUBLE_EQ(caster.firstHit(atTheLeaf)->distance, 2);
  door.displaced = true;  // open by a right angle: the leaf lies along +X from its hinge
  door.pose = {collision::Quat(std::sqrt(0.5), 0, std::sqrt(0.5), 0), {2, 0, 0}};
  snapshot.bodies = std::make_shared<const std::vector<BodySnapshot>>(1, door);
  caster.update(snapshot);
  EXPECT_FALSE(caster.isBlocked(atTheLeaf));
  const auto hit = caster.firstHit({{2.5, 1, -3}, Vec3::UnitZ()});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->entity, 2u);
  EXPECT_NEAR(hit->distance, 2.9375, 1e-12);
}

/// Reference: the test of Möller and Trumbore on every triangle, in doubles.
std::optional<double> computeSlowDistance(const std::vector<collision::Triangle>& triangles,
                                          const Ray& ray) {
  std::optional<double> nearest;
  for (const collision::Triangle& t : triangles) {
    const Vec3 a = t[1] - t[0], b = t[2] - t[0], p = ray.direction.cross(b);
    const double determinant = a.dot(p);
    if (determinant == 0) continue;
    const Vec3 s = ray.origin - t[0];
    const double u = s.dot(p) / determinant;
    if (u < 0 || u > 1) continue;
    const Vec3 q = s.cross(a);
    const double v = ray.direction.dot(q) / determinant, distance = b.dot(q) / determinant;
    if (v < 0 || u + v > 1 || distance < 0) continue;
    if (!nearest || distance < *nearest) nearest = distance;
  }
  return nearest;
}

/// Boxes of random orientation, scattered.
Model makeTumbledBoxes(std::mt19937& random) {
  std::uniform_real_distribution<double> place(-20, 20), size(0.1, 2), turn(-1, 1);
  Model model = makeBoxModel({{"box", {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}}});
  model.objects.clear();
  for (int i = 0; i < 200; ++i) {
    const Vec3 at(place(random), place(random), place(random));
    const Vec3 scale(size(random), size(random), size(random));
    const Vec3 axis(turn(random), turn(random), turn(random));
    Eigen::Affine3d worldFromMesh = Eigen::Translation3d(at) *
                                    Eigen::AngleAxisd(3 * turn(random), axis.normalized()) *
                                    Eigen::Scaling(scale);
    model.objects.push_back({"box#" + std::to_string(i), "", {0}, worldFromMesh});
  }
  return model;
}

TEST(RayCaster, AgreesWithDoublesOverAllTriangles) {
  std::mt19937 random(17);
  const auto scene = std::make_shared<const Scene>(makeTumbledBoxes(random));
  const RayCaster caster(scene);
  std::vector<collision::Triangle> triangles;
  for (const std::uint32_t object : scene->solidObjects())
    for (const collision::Triangle& t : collectSolidTriangles(scene->model(), object))
      triangles.push_back(t);
  std::uniform_real_distribution<double> any(-1, 1);
  int hits = 0, differ = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 way(any(random), any(random), any(random));
    const Ray ray{15 * Vec3(any(random), any(random), any(random)), way.normalized()};
    const auto slow = computeSlowDistance(triangles, ray);
    const auto fast = caster.firstHit(ray);
    if (slow.has_value() != fast.has_value()) {
      ++differ;  // along an edge, where one of them misses
      continue;
    }
    if (!slow) continue;
    ++hits;
    if (std::abs(*slow - fast->distance) > 1e-12 * (1 + *slow)) ++differ;
  }
  EXPECT_GT(hits, 200);
  EXPECT_LE(differ, 2) << "rays within a float's rounding of an edge";
}

TEST(RayCaster, LosesNothingFarFromTheOrigin) {
  const RayCaster caster(makeBoxScene({{"far", {2000, 0, -1}, {2001, 2, 1}}}));
  const auto hit = caster.firstHit({{0, 1, 0}, {1, 1e-4, 0}});
  ASSERT_TRUE(hit);
  EXPECT_DOUBLE_EQ(hit->distance, 2000 * std::sqrt(1 + 1e-8));
}

TEST(RayCaster, RefusesInvalidRays) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(validateRay(Ray{}));
  EXPECT_TRUE(validateRay(Ray{{nan, 0, 0}, Vec3::UnitX()}));
  EXPECT_TRUE(validateRay(Ray{{1e8, 0, 0}, Vec3::UnitX()}));
  EXPECT_TRUE(validateRay(Ray{Vec3::Zero(), Vec3::Zero()}));
  EXPECT_TRUE(validateRay(Ray{Vec3::Zero(), {kInfinity, 0, 0}}));
  EXPECT_TRUE(validateRay(Ray{Vec3::Zero(), Vec3::UnitX(), 0}));
  EXPECT_TRUE(validateRay(Ray{Vec3::Zero(), Vec3::UnitX(), nan}));
  RangeScan scan;
  EXPECT_FALSE(validateScan(scan));
  scan.up = scan.forward;
  EXPECT_TRUE(validateScan(scan));
}

TEST(RangeScan, GoesFromLeftToRightAndFromAboveToBelow) {
  RangeScan scan;
  scan.width = kPi / 2;
  scan.height = kPi / 4;
  scan.columns = 3;
  scan.rows = 2;
  const std::vector<Ray> rays = makeScanRays(scan);
  ASSERT_EQ(rays.size(), 6u);
  const double half = std::sqrt(0.5);
  EXPECT_LT(rays[0].direction.z(), 0) << "left of +X is -Z";
  EXPECT_GT(rays[2].direction.z(), 0);
  EXPECT_NEAR(rays[1].direction.z(), 0, 1e-15);
  EXPECT_NEAR(rays[0].direction.x() / rays[2].direction.x(), 1, 1e-12);
  EXPECT_NEAR(rays[1].direction.y(), std::sin(kPi / 8), 1e-15);
  EXPECT_NEAR(rays[4].direction.y(), -std::sin(kPi / 8), 1e-15);
  EXPECT_NEAR(-rays[0].direction.z() / rays[0].direction.x(), 1, 1e-12);
  EXPECT_NEAR(rays[0].direction.x(), half * std::cos(kPi / 8), 1e-15);
  for (const Ray& ray : rays) EXPECT_NEAR(ray.direction.norm(), 1, 1e-15);
}

TEST(RangeScan, OfAFullTurnMeetsAllFourWallsOnce) {
  const RayCaster caster(makeBoxScene({{"east", {3, 0, -9}, {4, 3, 9}},
                                       {"west", {-5, 0, -9}, {-4, 3, 9}},
                                       {"south", {-9, 0, 6}, {9, 3, 7}},
                                       {"north", {-9, 0, -6}, {9, 3, -5}}}));
  RangeScan scan;
  scan.origin = {0, 1, 0};
  scan.width = 2 * kPi;
  scan.columns = 4;
  std::vector<double> distances;
  for (const Ray& ray : makeScanRays(scan))
    distances.push_back(caster.firstHit(ray).value().distance);
  // From behind (west), over the left (north) and ahead (east), to the right (south).
  const std::vector<double> expected{4, 5, 3, 6};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(distances[i], expected[i], 1e-12) << i;
}

}  // namespace
}  // namespace enfilade::scene::testing
