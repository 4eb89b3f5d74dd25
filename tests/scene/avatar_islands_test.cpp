// Tests of islands of avatars that may meet, and of the threads that move them.
#include "scene/world/avatars/avatar_islands.hpp"

#include "tests/scene/busy_room.hpp"
#include "tests/scene/thin_geometry.hpp"
#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;

std::vector<NamedBox> makeWideFloor() {
  return {{"floor", {-40, -0.2, -40}, {40, 0, 40}},
          {"west", {-40.1, 0, -40}, {-40, 3, 40}},
          {"east", {40, 0, -40}, {40.1, 3, 40}},
          {"column", {-0.5, 0, -0.5}, {0.5, 3, 0.5}}};
}

std::vector<std::vector<std::string>> getNames(const World& world) {
  const AvatarIslands islands(world.data());
  std::vector<std::vector<std::string>> names(islands.size());
  for (std::size_t i = 0; i < islands.size(); ++i)
    for (const std::uint32_t member : islands.members(i))
      names[i].push_back(world.data().avatars[member].name);
  return names;
}

TEST(AvatarIslands, UniteAllWhoseBoundsOverlapInAChainAndLeaveOutTheIdle) {
  WorldFixture run(makeWideFloor());
  const std::vector<std::pair<std::string, double>> places{{"a", 0},  {"b", 20},  {"c", 0.65},
                                                           {"d", 30}, {"e", 1.3}, {"f", 20.65}};
  for (const auto& [name, x] : places) run.order(name, Spawn{{x, 0, 5}});
  run.runUntilIdle();
  run.runTicks(5);
  run.order("a", Drive{{0.6, 0, 0}});
  run.order("f", Drive{{0.6, 0, 0}});
  run.step();
  using Names = std::vector<std::string>;
  const std::vector<Names> expected{{"a", "c", "e"}, {"b", "f"}};
  EXPECT_EQ(getNames(run.world), expected) << "d stands alone";
}

/// Walkers that meet, block one another and part again, in several islands at a time.
std::vector<std::uint64_t> computeHashesOfWalk(int threads, std::vector<ContactEvent>& events) {
  WorldFixture run(makeWideFloor());
  setThreadCount(run.world, threads);
  Seeded random(7);
  for (int i = 0; i < 120; ++i)
    run.order("walker" + std::to_string(i),
              Spawn{{random.drawUniform(-9, 9), 0, random.drawUniform(-9, 9)}});
  std::vector<std::uint64_t> hashes;
  for (int tick = 0; tick < 240; ++tick) {
    if (tick % 60 == 1)
      for (const AvatarSnapshot& avatar : run.world.snapshot()->avatars)
        run.order(avatar.name, Drive{{random.drawUniform(-2, 2), 0, random.drawUniform(-2, 2)}});
    hashes.push_back(run.step().snapshot->stateHash);
  }
  EXPECT_GT(run.world.snapshot()->avatars.size(), 60u);
  EXPECT_GT(AvatarIslands(run.world.data()).size(), 16u) << "enough to use several threads";
  EXPECT_EQ(run.worstPenetration, 0);
  events = run.events;
  return hashes;
}

bool isSameEvent(const ContactEvent& x, const ContactEvent& y) {
  return x.tick == y.tick && x.kind == y.kind && x.a == y.a && x.b == y.b &&
         x.separation.distance == y.separation.distance &&
         x.separation.pointA == y.separation.pointA && x.separation.normal == y.separation.normal;
}

TEST(AvatarIslands, OneTwoAndEightThreadsGiveTheSameBitsAndEvents) {
  std::vector<ContactEvent> alone;
  const std::vector<std::uint64_t> hashes = computeHashesOfWalk(1, alone);
  EXPECT_GT(alone.size(), 200u);
  for (const int threads : {2, 8}) {
    std::vector<ContactEvent> events;
    EXPECT_EQ(computeHashesOfWalk(threads, events), hashes) << threads;
    EXPECT_TRUE(std::ranges::equal(events, alone, isSameEvent)) << threads;
  }
}

/// Doors, lifts, passengers, pushed avatars and rigid bodies among many walkers.
TEST(AvatarIslands, ThreadsDoNotChangeARoomWithMovingBodies) {
  const auto computeHashes = [](int threads) {
    BusyRoom room(3);
    setThreadCount(room.world, threads);
    for (int i = 0; i < 60; ++i)
      room.order("extra" + std::to_string(i), Spawn{{-8.0 + i % 10, 0, -8.0 + 1.5 * (i / 10)}});
    std::vector<std::uint64_t> hashes;
    for (int tick = 0; tick < 300; ++tick) {
      if (tick % 50 == 10)
        for (int i = 0; i < 60; ++i)
          room.order("extra" + std::to_string(i),
                     Drive{{1.5 - 0.1 * (i % 31), 0, 0.1 * ((i + tick) % 29) - 1.4}});
      hashes.push_back(tickWorld(room.world).snapshot->stateHash);
    }
    return hashes;
  };
  const std::vector<std::uint64_t> alone = computeHashes(1);
  EXPECT_EQ(computeHashes(2), alone);
  EXPECT_EQ(computeHashes(8), alone);
}

}  // namespace
}  // namespace enfilade::scene
