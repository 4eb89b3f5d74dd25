// Boxes of avatars: only links that moved get new ones, once a tick in free space; parts that turn
// get theirs from the extremal vertices of the last tick.
#include <gtest/gtest.h>

#include "scene/model/rotation.hpp"
#include "scene/world/data/avatar_shape.hpp"
#include "scene/world/data/world_data.hpp"
#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;

constexpr std::size_t kLinks = 8;

/// A flying prism with a chain of 8 bars of 0.2 m along +X.
Spawn snakeAt(const Vec3& at) {
  Spawn spawn;
  spawn.position = at;
  spawn.flying = true;
  for (std::size_t i = 0; i < kLinks; ++i) {
    const Vec3 anchor = i == 0 ? Vec3(0.35, 0.5, 0) : Vec3(0.21, 0, 0);
    spawn.links.push_back({static_cast<std::int32_t>(i) - 1,
                           {LinkJoint::Kind::revolute, anchor, {0, 0, 1}, -1, 1},
                           boxPoints({0, -0.02, -0.02}, {0.2, 0.02, 0.02})});
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
  run.order("snake", snakeAt({0, 3, 0}));
  run.ticks(3);
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
  WorldFixture run({floorBox()});
  EXPECT_EQ(countBoxes(run, driveLast()), std::vector<std::uint64_t>(8, 1));
}

TEST(AvatarBoxes, OfAChainInFreeSpaceAreMadeOnceATick) {
  WorldFixture run({floorBox()});
  EXPECT_EQ(countBoxes(run, driveAll()), std::vector<std::uint64_t>(8, kLinks));
}

TEST(AvatarBoxes, OfAChainFollowEachJointNextToAnObstacle) {
  WorldFixture run({floorBox(), {"wall", {0.4, 2.5, 0.03}, {3, 5, 0.1}}});
  for (const std::uint64_t boxes : countBoxes(run, driveAll())) {
    EXPECT_GT(boxes, kLinks);
    EXPECT_LE(boxes, kLinks * (kLinks + 1) / 2);
  }
}

TEST(AvatarBoxes, OfAChainAreThoseOfAllLinksMadeAnew) {
  WorldFixture run({floorBox(), {"post", {1.2, 3.6, -0.1}, {1.3, 6, 0.1}}});
  run.order("snake", snakeAt({0, 3, 0}));
  run.ticks(3);
  run.order("snake", driveAll());
  run.order("snake", driveLast());
  for (int i = 0; i < 40; ++i) {
    run.step();
    Avatar copy = run.world.data().avatars[0];
    const auto anew = makeChainShape(copy.baseParts, copy.chain, copy.boxWork);
    for (std::size_t part = 0; part < anew->parts.size(); ++part) {
      EXPECT_EQ(copy.shape->parts[part].offset, anew->parts[part].offset);
      EXPECT_EQ(copy.shape->parts[part].box.min, anew->parts[part].box.min);
      EXPECT_EQ(copy.shape->parts[part].box.max, anew->parts[part].box.max);
    }
    EXPECT_EQ(copy.shape->box.max, anew->box.max);
  }
  EXPECT_TRUE(run.touched("post"));
}

/// A flying cross of two parts, one of them of many vertices.
Spawn crossAt(const Vec3& at) {
  Spawn spawn;
  spawn.position = at;
  spawn.flying = true;
  spawn.parts = {boxPoints({-1, 0, -0.1}, {1, 1, 0.1}), {}};
  for (int i = 0; i < 100; ++i) {
    const Vec3 heading = makeHeadingFromDegrees(3.6 * i);
    for (const double y : {0.2, 0.4}) spawn.parts[1].push_back(0.5 * heading + Vec3(0.2, y, 0));
  }
  return spawn;
}

TEST(AvatarBoxes, OfTurningPartsAreMadeByTheExtremalVerticesOfTheLastTick) {
  WorldFixture run({floorBox()});
  run.order("cross", crossAt({0, 3, 0}));
  run.ticks(3);
  EXPECT_EQ(run.step().partBoxesMade, 0u) << "at rest";
  run.order("cross", Turn{90, true, 60});
  for (int i = 0; i < 20; ++i) {
    const TickReport report = run.step();
    EXPECT_EQ(report.partBoxesMade, 2u) << "tick " << i;
    EXPECT_LT(report.verticesLookedAt, 8u + 100) << "of 208, tick " << i;
    const AvatarSnapshot cross = run.view("cross");
    for (const AvatarPart& part : cross.shape->parts) {
      Aabb exact;
      for (const Vec3& v : part.hull->vertices) exact.include(part.rotation * v);
      EXPECT_TRUE(contains(part.box, exact));
      EXPECT_TRUE(contains(inflated(exact, 1e-13), part.box)) << "larger by the rounding alone";
    }
  }
}

}  // namespace
}  // namespace enfilade::scene
