// Tests of jumping, flying and crouching, and of the events that a move reports.
#include <cmath>

#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using Kind = Notice::Kind;

TEST(Jump, RisesToItsHeightAndEndsOnTheFloor) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runUntilIdle();
  const double ground = run.getFeet("ann").y();
  run.order("ann", Jump{0.8});
  double top = 0;
  for (int i = 0; i < 120 && run.count(Kind::done) == 0; ++i) {
    run.step();
    top = std::max(top, run.getFeet("ann").y() - ground);
  }
  EXPECT_EQ(run.count(Kind::done), 1);
  // The highest tick lies on the parabola, at most half a tick from its top.
  EXPECT_LE(top, 0.8 + 1e-9);
  EXPECT_GT(top, 0.8 - 0.5 * 9.80665 / 120 / 120 - 1e-9);
  EXPECT_NEAR(run.getFeet("ann").y(), ground, 1e-3);
  EXPECT_TRUE(run.getView("ann").grounded);
}

TEST(Jump, RightAfterASpawnWaitsForTheLanding) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{.position = {0, 0.3, 0}});
  run.order("ann", Jump{.height = 0.5});
  double top = 0;
  for (int i = 0; i < 120; ++i) {
    run.step();
    top = std::max(top, run.getFeet("ann").y());
  }
  EXPECT_EQ(run.count(Notice::Kind::refused), 0) << run.getText(Notice::Kind::refused);
  EXPECT_NEAR(top, 0.5, 0.02);
}

TEST(Walk, FromTheFloorBeginsAfterTheFall) {
  for (const bool fromFloor : {false, true}) {
    WorldFixture run({makeFloorBox()});
    run.order("ann", Spawn{.position = {0, 0.5, 0}});
    run.order("ann", Walk{.waypoints = {{2, 0, 0}}, .fromFloor = fromFloor});
    bool wentAcrossInTheAir = false;
    for (int i = 0; i < 240 && run.count(Kind::arrived) == 0; ++i) {
      run.step();
      const AvatarSnapshot ann = run.getView("ann");
      if (!ann.grounded && ann.footPosition.x() != 0) wentAcrossInTheAir = true;
    }
    EXPECT_EQ(run.count(Kind::arrived), 1) << fromFloor;
    EXPECT_NE(wentAcrossInTheAir, fromFloor);
  }
}

TEST(Walk, FromTheFloorBeginsAfterTheFallFromAFlight) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{.position = {0, 1, 0}, .flying = true});
  run.runTicks(5);
  run.order("ann", Fly{false});
  run.order("ann", Walk{.waypoints = {{2, 0, 0}}, .fromFloor = true});
  while (!run.getView("ann").grounded) {
    ASSERT_LT(run.world.snapshot()->tick, 120u);
    EXPECT_EQ(run.getFeet("ann").x(), 0);
    run.step();
  }
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::arrived), 1);
}

TEST(Walk, FromTheFloorBeginsInTheAirWhereNothingIsWalkable) {
  // Two walls of 70 degrees hold the avatar.
  Model pit =
      makeBoxModel({{"left", {-5, -0.2, -9}, {0, 0, 9}}, {"right", {0, -0.2, -9}, {5, 0, 9}}});
  const double steep = 70 * collision::kRadiansPerDegree;
  pit.objects[0].worldFromMesh.rotate(Eigen::AngleAxisd(-steep, Vec3::UnitZ()));
  pit.objects[1].worldFromMesh.rotate(Eigen::AngleAxisd(steep, Vec3::UnitZ()));
  WorldFixture run(std::make_shared<const Scene>(std::move(pit)));
  run.order("ann", Spawn{.position = {0, 2, 0}});
  run.order("ann", Walk{.waypoints = {{1, 2, 0}}, .fromFloor = true});
  run.runTicks(30);
  EXPECT_FALSE(run.getView("ann").grounded);
  EXPECT_EQ(run.count(Kind::blocked), 0);
  const double height = run.getFeet("ann").y();
  run.runTicks(static_cast<int>(60 * 2.5 * run.world.settings().stuckTimeout));
  EXPECT_EQ(run.count(Kind::blocked), 1) << "and not for ever under way";
  EXPECT_NEAR(run.getFeet("ann").y(), height, 0.01) << "it does not climb a wall";
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(Jump, OffALedgeGoesFartherThanWalkingOff) {
  const std::vector<NamedBox> scene{makeFloorBox(), {"ledge", {-9, 0, -2}, {0, 2, 2}}};
  WorldFixture run(scene);
  run.order("ann", Spawn{{-0.1, 2, 0}});
  run.runUntilIdle();
  run.order("ann", Jump{0.5, Vec3(2, 0, 0)});
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::done), 1);
  // 2 m/s for the time up and down: sqrt(2 h / g) + sqrt(2 (h + 2) / g).
  const double g = 9.80665, air = std::sqrt(2 * 0.5 / g) + std::sqrt(2 * 2.5 / g);
  EXPECT_NEAR(run.getFeet("ann").x(), -0.1 + 2 * air, 2.0 / 60 + 1e-3);
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(Jump, AgainstASteepSlopeDoesNotClimbIt) {
  Model model = makeBoxModel({makeFloorBox(), {"slope", {0, -0.2, -9}, {9, 0, 9}}});
  model.objects[1].worldFromMesh.translate(Vec3(1, 0, 0));
  model.objects[1].worldFromMesh.rotate(
      Eigen::AngleAxisd(60 * collision::kRadiansPerDegree, Vec3::UnitZ()));
  WorldFixture run(std::make_shared<const Scene>(std::move(model)));
  run.order("ann", Spawn{{0, 0, 0}});
  run.runUntilIdle();
  run.order("ann", Jump{0.5, Vec3(3, 0, 0)});
  double top = 0;
  for (int i = 0; i < 300; ++i) {
    run.step();
    top = std::max(top, run.getFeet("ann").y());
  }
  EXPECT_LT(top, 0.8) << "0.5 m, and the rest of the way up the slope in a tick or two";
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(Jump, ACeilingEndsTheRiseAndIsNotCrossed) {
  WorldFixture run({makeFloorBox(), {"ceiling", {-9, 2, -9}, {9, 2.001, 9}}});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runUntilIdle();
  run.order("ann", Jump{2});
  double top = 0;
  for (int i = 0; i < 120; ++i) {
    run.step();
    top = std::max(top, run.getFeet("ann").y());
  }
  EXPECT_LT(top, 0.25);
  EXPECT_GT(top, 0.248);
  EXPECT_TRUE(run.hasTouched("ceiling"));
  EXPECT_EQ(run.count(Kind::done), 1);
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(Jump, OfAFlyingAvatarOrTooHighIsRefused) {
  WorldFixture run({makeFloorBox()});
  EXPECT_TRUE(submitAvatarCommand(run.world, {"ann", Jump{std::nan("")}, 0}));
  EXPECT_TRUE(submitAvatarCommand(run.world, {"ann", Jump{0}, 0}));
  EXPECT_TRUE(
      submitAvatarCommand(run.world, {"ann", Jump{run.world.settings().maxJumpHeight * 1.01}, 0}));
  EXPECT_TRUE(submitAvatarCommand(run.world, {"ann", Jump{0.5, Vec3(0, INFINITY, 0)}, 0}));
  run.order("ann", Spawn{.position = {0, 5, 0}, .flying = true});
  run.order("ann", Jump{0.5});
  run.runTicks(2);
  EXPECT_EQ(run.count(Kind::refused), 1);
}

TEST(Fly, FollowsAStraightPathAndStopsAtObstacles) {
  WorldFixture run({makeFloorBox(), {"beam", {4, 2, -3}, {5, 6, 3}}});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", Fly{});
  run.order("ann", Walk{{{0, 3, 2}}, 2});
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::arrived), 1);
  EXPECT_NEAR((run.getFeet("ann") - Vec3(0, 3, 2)).norm(), 0, 1e-3);
  run.runTicks(60);
  EXPECT_NEAR((run.getFeet("ann") - Vec3(0, 3, 2)).norm(), 0, 1e-3) << "hovers";
  run.order("ann", Drive{{500, 0, 0}});
  run.runTicks(5);
  EXPECT_NEAR(run.getFeet("ann").x(), 4 - 0.3, 0.01);
  EXPECT_EQ(run.getView("ann").move.blockedBy, 2u);
  run.order("ann", Drive{});
  run.order("ann", Fly{false});
  run.runUntilIdle();
  EXPECT_LT(run.getFeet("ann").y(), 0.001);
  EXPECT_TRUE(run.getView("ann").grounded);
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(Fly, ASpawnInTheAirNeedsNoFloorAndFlightEnds) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{.position = {50, 20, 0}, .flying = true});
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::spawned), 1);
  run.order("ann", Drive{{0, 900, 0}});
  run.runTicks(120);
  EXPECT_EQ(run.count(Kind::left), 1);
  EXPECT_NE(run.getText(Kind::left).find("out of the scene"), std::string::npos);
}

TEST(Crouch, PassesUnderALowObstacleAndStandsUpOnlyWithRoom) {
  WorldFixture run({makeFloorBox(), {"duct", {2, 1.2, -3}, {4, 1.3, 3}}});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", makeWalkTo(3, 0));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::blocked), 1);
  run.order("ann", Crouch{1.0});
  run.order("ann", makeWalkTo(3, 0));
  run.order("ann", Crouch{});
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::arrived), 1);
  EXPECT_EQ(run.count(Kind::refused), 1);
  EXPECT_EQ(run.notices.back().obstacle, 2u) << "the duct";
  EXPECT_EQ(run.getView("ann").height, 1.0);
  run.order("ann", makeWalkTo(6, 0));
  run.order("ann", Crouch{});
  run.runUntilIdle();
  EXPECT_EQ(run.getView("ann").height, 1.75);
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(Crouch, HeightsBelowAThirdOrAboveTheSpawnHeightAreRefused) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", Crouch{0.3});
  run.order("ann", Crouch{1.8});
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::refused), 2);
  EXPECT_NE(run.getText(Kind::refused).find(" m; give 0.525 to 1.75 m"), std::string::npos);
  EXPECT_EQ(run.getView("ann").height, 1.75);
}

TEST(MoveResult, ReportsTheDisplacementAndTheObstacleOfADrive) {
  WorldFixture run({makeFloorBox(), {"wall", {2, 0, -3}, {2.2, 3, 3}}});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runUntilIdle();
  run.order("ann", Drive{{1.2, 0, 0}});
  run.step();
  EXPECT_NEAR(run.getView("ann").move.requestedDisplacement.x(), 0.02, 1e-12);
  EXPECT_NEAR(run.getView("ann").move.actualDisplacement.x(), 0.02, 1e-12);
  EXPECT_EQ(run.getView("ann").move.blockedBy, 0u);
  run.runTicks(200);
  const MoveResult move = run.getView("ann").move;
  EXPECT_NEAR(move.requestedDisplacement.x(), 0.02, 1e-12);
  EXPECT_NEAR(move.actualDisplacement.norm(), 0, 1e-9);
  EXPECT_EQ(findEntityName(run.world, move.blockedBy), "wall");
  EXPECT_EQ(move.separation.verdict, collision::Verdict::separated);
  EXPECT_LT(move.separation.distance, 2 * run.world.settings().contactOffset);
  EXPECT_NEAR(move.separation.normal.x(), 1, 1e-9);
}

TEST(MoveResult, TheLastTickWithAnObstacleIsKeptAndTheFloorIsNone) {
  WorldFixture run(
      {makeFloorBox(), {"wall", {2, 0, -3}, {2.2, 3, 3}}, {"step", {-4, 0, -3}, {-2, 0.2, 3}}});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runUntilIdle();
  run.order("ann", Drive{{1.5, 0, 0}});
  std::uint64_t last = 0;
  for (int i = 0; i < 100; ++i) {
    run.step();
    if (run.getView("ann").move.blockedBy != 0) last = run.world.snapshot()->tick;
    ASSERT_EQ(run.getView("ann").lastStoppedTick, last);
  }
  EXPECT_EQ(last, run.world.snapshot()->tick);
  run.order("ann", Drive{{-1.5, 0, 0}});
  run.runTicks(160);
  EXPECT_GT(run.getFeet("ann").y(), 0.19);  // it climbed the step
  EXPECT_EQ(run.getView("ann").lastStoppedTick, last);
}

TEST(MoveResult, BlockedIsReportedOnceEachTimeItBegins) {
  WorldFixture run({makeFloorBox(), {"wall", {2, 0, -3}, {2.2, 3, 3}}});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runUntilIdle();
  const auto countBlocked = [&] {
    return std::count_if(run.events.begin(), run.events.end(), [](const ContactEvent& e) {
      return e.kind == ContactEvent::Kind::blocked;
    });
  };
  run.order("ann", Drive{{1.5, 0, 0}});
  run.runTicks(300);
  EXPECT_EQ(countBlocked(), 1);
  run.order("ann", Drive{{-1.5, 0, 0}});
  run.runTicks(30);
  EXPECT_EQ(countBlocked(), 1);
  run.order("ann", Drive{{1.5, 0, 0}});
  run.runTicks(100);
  EXPECT_EQ(countBlocked(), 2);
}

TEST(Sliding, StopLeavesNothingOfAMoveAlongAWall) {
  WorldSettings settings;
  settings.sliding = Sliding::stop;
  WorldFixture run({makeFloorBox(), {"wall", {2, 0, -9}, {2.2, 3, 9}}}, settings);
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", makeWalkTo(3, 6));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::blocked), 1);
  // The velocity is 3 m/s across and 6 m/s along: the avatar reaches the wall 1.7 m across and 3.4
  // m along, and stops there.
  EXPECT_NEAR(run.getFeet("ann").z(), 3.4, 0.01);
  EXPECT_EQ(run.worstPenetration, 0);
  WorldFixture slides({makeFloorBox(), {"wall", {2, 0, -9}, {2.2, 3, 9}}});
  EXPECT_NE(run.world.snapshot()->stateHash, slides.world.snapshot()->stateHash);
}

TEST(Spawn, WhereThereIsNoRoomItSaysWhereThereIs) {
  WorldFixture run({makeFloorBox(), {"pillar", {-1, 0, -1}, {1, 3, 1}}});
  run.order("ann", Spawn{{0.9, 0, 0}});
  run.step();
  const std::string text = run.getText(Kind::refused);
  EXPECT_NE(text.find("there is room at [1.4"), std::string::npos) << text;
}

TEST(Spawn, ARefusalIsAtThePlaceThatItGave) {
  WorldFixture run({makeFloorBox(), {"pillar", {0, 0, -1}, {1, 3, 1}}});
  run.order("ann", Spawn{{0.5, 0, 0.25}});
  run.runUntilIdle();
  ASSERT_EQ(run.count(Notice::Kind::refused), 1);
  const auto refusal = std::ranges::find(run.notices, Notice::Kind::refused, &Notice::kind);
  EXPECT_EQ(refusal->position, Vec3(0.5, 0, 0.25));
}

TEST(Spawn, WithTheHeadInTheCeilingItNamesTheFloorBelow) {
  // A hall without walls near; the roof above the ceiling has free places too, but higher.
  WorldFixture run({makeFloorBox(), {"ceiling", {-9, 2.5, -9}, {9, 2.8, 9}}});
  run.order("ann", Spawn{{0, 1.2, 0}});
  run.step();
  const std::string text = run.getText(Kind::refused);
  EXPECT_NE(text.find("it would overlap ceiling"), std::string::npos) << text;
  EXPECT_NE(text.find("there is room at [0, 0.0005, 0]"), std::string::npos) << text;
}

TEST(Spawn, HighAboveTheFloorIsReportedAndTooHighIsRefused) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 30, 0}});
  run.order("bob", Spawn{{2, 500, 0}});
  run.step();
  EXPECT_NE(run.getText(Kind::spawned).find("drops 30 m to floor"), std::string::npos);
  EXPECT_NE(run.getText(Kind::refused).find("the maximum drop is"), std::string::npos);
}

}  // namespace
}  // namespace enfilade::scene
