// Boxes of avatars: only links that moved get new ones, once a tick in free space. Parts that turn
// get theirs from the extremal vertices of the last tick. Placed boxes contain the exact part.
#include <gmpxx.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "scene/model/rotation.hpp"
#include "scene/world/avatars/spawn.hpp"
#include "scene/world/data/avatar_shape.hpp"
#include "scene/world/data/world_data.hpp"
#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;

constexpr std::size_t kLinks = 8;

/// A flying prism with a chain of 8 bars of 0.2 m along +X.
Spawn makeSnakeAt(const Vec3& at) {
  Spawn spawn;
  spawn.position = at;
  spawn.flying = true;
  for (std::size_t i = 0; i < kLinks; ++i) {
    const Vec3 anchor = i == 0 ? Vec3(0.35, 0.5, 0) : Vec3(0.21, 0, 0);
    spawn.links.push_back({static_cast<std::int32_t>(i) - 1,
                           {LinkJoint::Kind::revolute, anchor, {0, 0, 1}, -1, 1},
                           makeBoxPoints({0, -0.02, -0.02}, {0.2, 0.02, 0.02})});
  }
  return spawn;
}

DriveJoints driveLast() {
  DriveJoints drive;
  drive.targets.resize(kLinks);
  drive.targets.back() = 0.5;
  return drive;
}

DriveJoints driveAll() {
  return {std::vector<std::optional<double>>(kLinks, 0.2)};
}

/// Boxes of parts made in each of the ticks after the start of `drive`.
std::vector<std::uint64_t> countBoxes(WorldFixture& run, const DriveJoints& drive) {
  run.order("snake", makeSnakeAt({0, 3, 0}));
  run.runTicks(3);
  run.order("snake", drive);
  std::vector<std::uint64_t> boxes;
  for (int i = 0; i < 8; ++i) {
    const TickReport report = run.step();
    EXPECT_GE(report.verticesLookedAt, 8 * report.partBoxesMade) << "tick " << i;
    boxes.push_back(report.partBoxesMade);
  }
  return boxes;
}

TEST(AvatarBoxes, OfAChainAreMadeForMovedLinksAlone) {
  WorldFixture run({makeFloorBox()});
  EXPECT_EQ(countBoxes(run, driveLast()), std::vector<std::uint64_t>(8, 1));
}

TEST(AvatarBoxes, OfAChainInFreeSpaceAreMadeOnceATick) {
  WorldFixture run({makeFloorBox()});
  EXPECT_EQ(countBoxes(run, driveAll()), std::vector<std::uint64_t>(8, kLinks));
}

TEST(AvatarBoxes, OfAChainFollowEachJointNextToAnObstacle) {
  WorldFixture run({makeFloorBox(), {"wall", {0.4, 2.5, 0.03}, {3, 5, 0.1}}});
  for (const std::uint64_t boxes : countBoxes(run, driveAll())) {
    EXPECT_GT(boxes, kLinks);
    EXPECT_LE(boxes, kLinks * (kLinks + 1) / 2);
  }
}

TEST(AvatarBoxes, OfAChainAreThoseOfAllLinksMadeTogether) {
  WorldFixture run({makeFloorBox(), {"post", {1.2, 3.6, -0.1}, {1.3, 6, 0.1}}});
  run.order("snake", makeSnakeAt({0, 3, 0}));
  run.runTicks(3);
  run.order("snake", driveAll());
  run.order("snake", driveLast());
  for (int i = 0; i < 40; ++i) {
    run.step();
    Avatar copy = run.world.data().avatars[0];
    const auto whole = makeChainShape(copy.baseParts, copy.chain, copy.boxWork);
    for (std::size_t part = 0; part < whole->parts.size(); ++part) {
      EXPECT_EQ(copy.shape->parts[part].offset, whole->parts[part].offset);
      EXPECT_EQ(copy.shape->parts[part].box.min, whole->parts[part].box.min);
      EXPECT_EQ(copy.shape->parts[part].box.max, whole->parts[part].box.max);
    }
    EXPECT_EQ(copy.shape->box.max, whole->box.max);
  }
  EXPECT_TRUE(run.hasTouched("post"));
}

/// A flying cross of two parts, one of them of many vertices.
Spawn makeCrossAt(const Vec3& at) {
  Spawn spawn;
  spawn.position = at;
  spawn.flying = true;
  spawn.parts = {makeBoxPoints({-1, 0, -0.1}, {1, 1, 0.1}), {}};
  for (int i = 0; i < 200; ++i) {
    const double height = (i + 0.5) / 100 - 1;
    const Vec3 rim = std::sqrt(1 - height * height) * makeHeadingFromDegrees(137.5 * i);
    spawn.parts[1].emplace_back(0.5 * rim.x(), 0.4 + 0.3 * height, 0.4 * rim.z());
  }
  return spawn;
}

TEST(AvatarBoxes, OfTurningPartsAreMadeByTheExtremalVerticesOfTheLastTick) {
  WorldFixture run({makeFloorBox()});
  run.order("cross", makeCrossAt({0, 3, 0}));
  run.runTicks(3);
  EXPECT_EQ(run.step().partBoxesMade, 0u) << "at rest";
  run.order("cross", Turn{90, true, 60});
  for (int i = 0; i < 20; ++i) {
    const TickReport report = run.step();
    EXPECT_EQ(report.partBoxesMade, 2u) << "tick " << i;
    EXPECT_LT(report.verticesLookedAt, 8u + 100) << "of 208, tick " << i;
    const AvatarSnapshot cross = run.getView("cross");
    for (const AvatarPart& part : cross.shape->parts) {
      Aabb exact;
      for (const Vec3& v : part.hull->vertices) exact.include(part.rotation * v);
      EXPECT_TRUE(contains(part.box, exact));
      EXPECT_TRUE(contains(inflate(exact, 1e-13), part.box)) << "larger by the rounding alone";
    }
  }
}

/// Whether a placed box contains the part exactly. Once with its rounded translation, as the narrow
/// phase sees it, and once with the exact sum of foot position and offset.
bool containsExactly(const Aabb& box, const AvatarPart& part, const Vec3& footPosition) {
  const collision::PlacedConvex placed = placeAvatarPart(part, footPosition);
  for (const Vec3& v : part.hull->vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      mpq_class at = 0;
      for (int k = 0; k < 3; ++k) at += mpq_class(part.rotation(axis, k)) * v[k];
      const mpq_class seen = at + placed.translation[axis];
      const mpq_class exact = at + mpq_class(footPosition[axis]) + part.offset[axis];
      if (seen < box.min[axis] || seen > box.max[axis]) return false;
      if (exact < box.min[axis] || exact > box.max[axis]) return false;
    }
  }
  return true;
}

TEST(AvatarBoxes, OfPartsAndLinksAreConservativeAKilometreAway) {
  Spawn order = makeSnakeAt(Vec3::Zero());
  order.parts = makeCrossAt(Vec3::Zero()).parts;
  for (Link& link : order.links) link.joint.axis = Vec3(1, 2, 3);
  order.links[3].points = makeBoxPoints({0.7, 0.1, 0.2}, {0.9, 0.15, 0.3});  // far from its joint
  Avatar avatar;
  applySpawnShape(order, {}, avatar);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> angle(-1, 1), far(1000, 2000);
  int plainSums = 0;  // that are not conservative
  for (int i = 0; i < 200; ++i) {
    for (ChainLink& link : avatar.chain.links) link.value = angle(random);
    setFacing(avatar, 180 * angle(random));
    const double x = far(random), y = far(random), z = -far(random);
    const Vec3 foot(x, y, z);
    for (const AvatarPart& part : avatar.shape->parts) {
      EXPECT_TRUE(containsExactly(placeBoxOutward(part.box, foot), part, foot)) << "pose " << i;
      const Aabb plain = placeBox(part.box, foot);
      plainSums += containsExactly(plain, part, foot) ? 0 : 1;
    }
  }
  EXPECT_GT(plainSums, 500) << "of 2,000";
}

}  // namespace
}  // namespace enfilade::scene
