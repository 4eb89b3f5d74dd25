// Tests of avatars that block one another: none jitters, none penetrates another, none leaves the
// corridor.
#include <functional>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;

std::vector<NamedBox> makeCorridorBoxes(double width, double length) {
  return {{"floor", {-length, -0.2, -5}, {length, 0, 5}},
          {"left", {-length, 0, -0.5 * width - 0.1}, {length, 3, -0.5 * width}},
          {"right", {-length, 0, 0.5 * width}, {length, 3, 0.5 * width + 0.1}},
          {"west", {-length - 0.1, 0, -5}, {-length, 3, 5}},
          {"east", {length, 0, -5}, {length + 0.1, 3, 5}}};
}

TEST(Crowd, TwoAvatarsThatMeetHeadOnStandBitExactlyStill) {
  for (const double aside : {0.0, 0.05, 0.2, 0.5}) {
    WorldFixture run(makeCorridorBoxes(1.0, 10));
    run.order("ann", Spawn{{-2, 0, -0.1}});
    run.order("bob", Spawn{{2, 0, -0.1 + (aside > 0.19 ? 0.19 : aside)}});
    run.runUntilIdle();
    run.order("ann", Drive{{1.3, 0, 0.1 * aside}});
    run.order("bob", Drive{{-1.4, 0, 0.2 * aside}});
    run.runTicks(400);
    const Vec3 ann = run.getFeet("ann"), bob = run.getFeet("bob");
    for (int i = 0; i < 100; ++i) {
      run.step();
      ASSERT_EQ(run.getFeet("ann"), ann) << "aside " << aside << ", tick " << i;
      ASSERT_EQ(run.getFeet("bob"), bob) << "aside " << aside << ", tick " << i;
    }
    EXPECT_LT(bob.x() - ann.x(), 0.65) << aside;
    EXPECT_EQ(run.worstPenetration, 0);
  }
}

TEST(Crowd, AvatarDrivenIntoCornerStands) {
  for (const double angle : {0.1, 0.5, 0.9}) {
    WorldFixture run(makeCorridorBoxes(1.0, 10));
    run.order("ann", Spawn{{9, 0, 0}});
    run.runUntilIdle();
    run.order("ann", Drive{{1 - angle, 0, angle}});
    run.runTicks(900);
    const Vec3 feet = run.getFeet("ann");
    for (int i = 0; i < 100; ++i) {
      run.step();
      ASSERT_EQ(run.getFeet("ann"), feet) << angle << ", tick " << i;
    }
    EXPECT_GT(feet.x(), 9.6);
  }
}

TEST(Crowd, TwoHundredAvatarsInACorridorNeverPenetrateOrEscape) {
  WorldFixture run(makeCorridorBoxes(4, 30));
  for (int i = 0; i < 200; ++i) {
    const double x = -24.5 + 1.0 * (i / 4), z = -1.5 + 1.0 * (i % 4);
    run.order("a" + std::to_string(i), Spawn{{x, 0, z}});
  }
  run.step();
  ASSERT_EQ(run.count(Notice::Kind::spawned), 200);
  std::mt19937_64 random(4);
  for (int i = 0; i < 200; ++i) {
    const double speed = 0.5 + static_cast<double>(random() % 1000) / 400;
    const double aside = static_cast<double>(random() % 1000) / 1000 - 0.5;
    run.order("a" + std::to_string(i), Drive{{i % 2 ? speed : -speed, 0, aside}});
  }
  for (int i = 0; i < 240; ++i) run.step();
  EXPECT_EQ(run.worstPenetration, 0);
  for (const AvatarSnapshot& a : run.world.snapshot()->avatars) {
    EXPECT_LT(std::abs(a.footPosition.z()), 1.7) << a.name;
    EXPECT_LT(std::abs(a.footPosition.x()), 29.7) << a.name;
    EXPECT_LT(a.footPosition.y(), 0.3) << a.name;
  }
}

TEST(Crowd, AvatarDrivenIntoTooNarrowGapStands) {
  for (int i = 0; i < 24; ++i) {
    const double gap = 0.2 + 0.016 * i, turn = 0.5 - 0.04 * i;  // less than 0.6 m
    WorldFixture run({{"floor", {-10, -0.2, -10}, {10, 0, 10}},
                      {"left", {2, 0, -6}, {2.05, 3, -0.5 * gap}},
                      {"right", {2, 0, 0.5 * gap}, {2.05, 3, 6}}});
    run.order("ann", Spawn{{0, 0, 0.003 * i}});
    run.runUntilIdle();
    run.order("ann", Drive{{1.3, 0, 0.1 * turn}});
    run.runTicks(1200);
    const Vec3 feet = run.getFeet("ann");
    EXPECT_LT(feet.x(), 2.2);
    for (int tick = 0; tick < 30; ++tick) {
      run.step();
      ASSERT_EQ(run.getFeet("ann"), feet) << gap << ", tick " << tick;
    }
  }
}

/// Avatars in a hall with one door, and how they fare.
struct Hall {
  WorldFixture run;
  std::set<std::string> arrived;
  int blocked = 0;
  int reversals = 0;  ///< steps back and forth, of all

  explicit Hall(int avatars)
      : run({{"floor", {-20, -0.2, -12}, {40, 0, 12}},
             {"left", {0, 0, -12}, {0.2, 3, -0.6}},
             {"right", {0, 0, 0.6}, {0.2, 3, 12}}}) {
    for (int i = 0; i < avatars; ++i) run.order(makeName(i), Spawn{start(i)});
    run.step();
    EXPECT_EQ(run.count(Notice::Kind::spawned), avatars);
  }

  static std::string makeName(int i) { return "a" + std::to_string(i); }
  static Vec3 start(int i) { return {-1.5 - 0.8 * (i / 20), 0, -8 + 0.8 * (i % 20)}; }
  static Vec3 computeGoal(int i) { return {12, 0, -9 + 1.2 * (i % 16)}; }

  /// Avatars that arrive leave; none is sent again.
  void walkAll(int avatars, const std::function<std::vector<Vec3>(int)>& waypoints) {
    for (int i = 0; i < avatars; ++i) {
      Walk walk;
      walk.waypoints = waypoints(i);
      walk.speed = 1.3;
      run.order(makeName(i), walk);
      run.order(makeName(i), Leave{});
    }
    std::size_t seen = run.notices.size();
    std::map<EntityId, Vec3> last;
    for (int tick = 0; tick < 60 * 200 && !run.world.snapshot()->avatars.empty(); ++tick) {
      run.step();
      for (const AvatarSnapshot& a : run.world.snapshot()->avatars) {
        const Vec3 step = a.move.actualDisplacement;
        if (step.norm() < 1e-4) continue;
        Vec3& before = last.try_emplace(a.id, step).first->second;
        if (step.dot(before) < 0) ++reversals;
        before = step;
      }
      for (; seen < run.notices.size(); ++seen) {
        const Notice& notice = run.notices[seen];
        if (notice.kind == Notice::Kind::arrived) arrived.insert(notice.avatar);
        if (notice.kind == Notice::Kind::blocked) ++blocked;
      }
    }
  }
};

TEST(Crowd, TwoHundredAvatarsLeaveByOneDoorAndNobodyIsStuck) {
  Hall hall(200);
  hall.walkAll(200, [](int i) {
    return std::vector<Vec3>{{-0.4, 0, 0}, {2, 0, 0}, Hall::computeGoal(i)};
  });
  EXPECT_EQ(hall.arrived.size(), 200u);
  EXPECT_EQ(hall.blocked, 0);
  EXPECT_EQ(hall.run.worstPenetration, 0);
  EXPECT_LT(hall.reversals, 200 * 12);
}

/// The waypoints of shortest paths touch the posts, and lead in from both sides, so that the crowd
/// forms an arch.
TEST(Crowd, AvatarsOnShortestPathsLeaveByOneDoorAndNobodyIsStuck) {
  for (const int avatars : {20, 200}) {
    Hall hall(avatars);
    hall.walkAll(avatars, [](int i) -> std::vector<Vec3> {
      if (Hall::start(i).z() < 0)
        return {{-0.35, 0, -0.5}, {-0.15, 0, -0.25}, {0.4, 0, -0.25}, Hall::computeGoal(i)};
      return {{-0.3, 0, 0.45}, {-0.05, 0, 0.25}, {0.4, 0, 0.3}, Hall::computeGoal(i)};
    });
    EXPECT_EQ(hall.arrived.size(), static_cast<std::size_t>(avatars));
    EXPECT_EQ(hall.blocked, 0);
    EXPECT_EQ(hall.run.worstPenetration, 0);
    EXPECT_LT(hall.reversals, avatars * 12);
  }
}

/// All avatars press towards one end, each also a little sideways, until they stop.
TEST(Crowd, AvatarBlockedInACrowdDoesNotJitter) {
  constexpr int kThrong = 120;
  WorldFixture run(makeCorridorBoxes(4, 30));
  for (int i = 0; i < kThrong; ++i) {
    const double x = 13.5 + 0.66 * (i / 5), z = -1.5 + 0.75 * (i % 5);
    run.order("a" + std::to_string(i), Spawn{{x, 0, z}});
  }
  run.step();
  ASSERT_EQ(run.count(Notice::Kind::spawned), kThrong);
  for (int i = 0; i < kThrong; ++i)
    run.order("a" + std::to_string(i), Drive{{1.3, 0, 0.1 * (i % 7 - 3)}});
  run.runTicks(420);
  const auto feetOfAll = [&] {
    std::vector<Vec3> feet;
    for (const AvatarSnapshot& a : run.world.snapshot()->avatars) feet.push_back(a.footPosition);
    return feet;
  };
  const std::vector<Vec3> before = feetOfAll();
  for (int tick = 0; tick < 30; ++tick) {
    run.step();
    ASSERT_EQ(feetOfAll(), before) << "tick " << tick;
  }
  EXPECT_EQ(run.worstPenetration, 0);
}

}  // namespace
}  // namespace enfilade::scene
