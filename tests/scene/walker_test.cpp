// A walk that is proved is the walk of an avatar in a world.
#include "scene/navigation/walk/walker.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "scene/world/world.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene::testing {
namespace {

constexpr int kRestTicks = 30;

/// Low boxes on a floor, around a platform with a ledge. Between both is a face that is too steep
/// to stand on: an avatar slides over its edge, and falls by less than a step.
std::shared_ptr<const Scene> makeBumpyRoom(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<NamedBox> boxes{makeFloorBox(),
                              {"platform", {-1, 0, -1}, {1, 0.5, 1}},
                              {"ledge", {1, 0, -1}, {1.6, 0.15, 1}}};
  for (int i = 0; i < 60; ++i) {
    const double x = 2 + 3 * unit(random), z = -5 + 10 * unit(random);
    const double width = 0.1 + 0.8 * unit(random), depth = 0.1 + 0.8 * unit(random);
    const double height = 0.32 * unit(random);
    boxes.push_back({"box/" + std::to_string(i), {x, 0, z}, {x + width, height, z + depth}});
  }
  Model model = makeBoxModel(boxes);
  Mesh& platform = model.meshes[model.objects[1].meshes.front()];
  for (auto& position : platform.positions)
    if (position.x() > 0 && position.y() < 0.1) position.x() = 1.25F;
  return std::make_shared<const Scene>(std::move(model));
}

/// Where the avatar ends that walks along `waypoints`; nullopt: it is blocked.
std::optional<Vec3> walkInWorld(World& world, const std::vector<Vec3>& waypoints) {
  submitAvatarCommand(world, {"walker", Walk{waypoints}, 0});
  for (int tick = 0; tick < 60 * 60; ++tick)
    for (const Notice& notice : tickWorld(world).notices) {
      if (notice.kind == Notice::Kind::blocked) return std::nullopt;
      if (notice.kind == Notice::Kind::arrived)
        return world.snapshot()->avatars.front().footPosition;
    }
  return std::nullopt;
}

struct Walks {
  int arrived = 0, flights = 0;  ///< flights: over a waypoint in the air
};

void compareWalks(unsigned seed, Walks& walks) {
  const auto scene = makeBumpyRoom(seed);
  std::mt19937 random(seed + 1);
  std::uniform_real_distribution<double> side(-1, 1);
  World world(scene);
  submitAvatarCommand(world, {"walker", Spawn{{0, 0.51, 0}}, 0});
  for (int tick = 0; tick < kRestTicks; ++tick) tickWorld(world);
  const World atRest(scene);
  Walker walker(atRest.data(), {});
  walker.returnTo(world.snapshot()->avatars.front().footPosition);
  std::vector<Vec3> waypoints{{1.35, 0, 0.4 * side(random)}};  // beyond the edge
  while (waypoints.size() < 4)
    waypoints.emplace_back(3 + side(random), 0, waypoints.back().z() + side(random));
  bool isFlight = false;
  for (const Vec3& waypoint : waypoints) {
    const WalkOutcome outcome = walker.walkOn(waypoint);
    if (outcome.kind != WalkOutcome::Kind::arrived) return;
    isFlight |= &waypoint == &waypoints.front() && outcome.footPosition.y() > 0.16;
  }
  const auto end = walkInWorld(world, waypoints);
  ASSERT_TRUE(end) << "seed " << seed;
  EXPECT_LT((*end - walker.footPosition()).norm(), 1e-9) << "seed " << seed;
  ++walks.arrived;
  walks.flights += isFlight ? 1 : 0;
}

TEST(Walker, AProvedWalkIsThatOfAnAvatar) {
  Walks walks;
  for (unsigned seed = 0; seed < 60; ++seed) compareWalks(seed, walks);
  EXPECT_GE(walks.arrived, 20);
  EXPECT_GE(walks.flights, 5);
}

/// A waypoint in the air is reached, and the fall continues: as a whole it is at most a step deep.
TEST(Walker, AFallIsMeasuredFromTheFloorAlsoOverAWaypoint) {
  const World world(makeBoxScene({makeFloorBox(), {"platform", {-1, 0, -1}, {1, 0.5, 1}}}));
  Walker walker(world.data(), {});
  walker.returnTo({0, 0.5 + world.settings().contactOffset, 0});
  const WalkOutcome first = walker.walkOn({1.55, 0, 0});
  ASSERT_EQ(first.kind, WalkOutcome::Kind::arrived);
  EXPECT_GT(first.footPosition.y(), 0.1) << "it should be in the air";
  EXPECT_LT(first.footPosition.y(), world.settings().stepHeight) << "no deep fall from there";
  EXPECT_EQ(walker.walkOn({3, 0, 0}).kind, WalkOutcome::Kind::fell);
}

TEST(Walker, TheWayOfTheFeetCountsHeights) {
  const World world(makeBoxScene({makeFloorBox(), {"step", {1, 0, -1}, {2, 0.25, 1}}}));
  Walker walker(world.data(), {});
  walker.returnTo({0, world.settings().contactOffset, 0});
  ASSERT_EQ(walker.walkTo({3, 0, 0}).kind, WalkOutcome::Kind::arrived);
  EXPECT_NEAR(walker.travel().climb, 0.5, 0.01);
  EXPECT_NEAR(walker.travel().length(), 3.5, 0.01);
  walker.returnTo({0, world.settings().contactOffset, 3});
  ASSERT_EQ(walker.walkTo({3, 0, 3}).kind, WalkOutcome::Kind::arrived);
  EXPECT_NEAR(walker.travel().length(), 3, 0.01);
  EXPECT_NEAR(walker.travel().climb, 0, 1e-3);
}

}  // namespace
}  // namespace enfilade::scene::testing
