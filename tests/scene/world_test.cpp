#include "scene/world/world.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using Kind = Notice::Kind;

const double kNaN = std::nan("");

TEST(World, ASpawnAtTheFloorsOwnHeightComesToRestOnIt) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runUntilIdle();
  EXPECT_GE(run.getFeet("ann").y(), run.world.settings().contactOffset);
  EXPECT_LT(run.getFeet("ann").y(), 2 * run.world.settings().contactOffset);
  EXPECT_TRUE(run.world.snapshot()->avatars[0].grounded);
  EXPECT_TRUE(run.hasTouched("floor"));
}

TEST(World, ASpawnALittleAboveAFloorDropsOntoIt) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 1, 0}});
  run.step();
  EXPECT_GT(run.getFeet("ann").y(), 0.9);
  run.runUntilIdle();
  EXPECT_LT(run.getFeet("ann").y(), 0.001);
  EXPECT_EQ(run.count(Kind::spawned), 1);
}

TEST(World, ASpawnInsideSomethingOrOffEveryFloorSaysSo) {
  WorldFixture run({makeFloorBox(), {"pillar", {-1, 0, -1}, {1, 3, 1}}});
  run.order("inside", Spawn{{0, 0.5, 0}});  // wholly inside the closed pillar
  run.order("across", Spawn{{1, 0, 0}});    // cuts its surface
  run.order("nowhere", Spawn{{50, 0, 0}});
  run.order("nowhere", makeWalkTo(0, 0));
  run.step();
  ASSERT_EQ(run.count(Kind::refused), 3);
  std::map<std::string, std::string> text;
  for (const Notice& n : run.notices)
    if (n.kind == Kind::refused) text[n.avatar] = n.text;
  EXPECT_NE(text["inside"].find("inside the solid pillar"), std::string::npos) << text["inside"];
  EXPECT_NE(text["across"].find("pillar"), std::string::npos) << text["across"];
  EXPECT_NE(text["nowhere"].find("no floor"), std::string::npos) << text["nowhere"];
  EXPECT_NE(text["nowhere"].find("1 queued"), std::string::npos) << text["nowhere"];
  EXPECT_TRUE(run.world.snapshot()->avatars.empty());
}

TEST(World, AWalkArrivesExactlyWhereItWasSent) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{-5, 0, 0}});
  run.order("ann", Walk{{{-2, 0, 1}, {3, 0, -2}}, 1.5});
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::arrived), 1);
  EXPECT_NEAR(run.getFeet("ann").x(), 3, 1e-9);
  EXPECT_NEAR(run.getFeet("ann").z(), -2, 1e-9);
}

TEST(World, AWallStopsAWalkAndIsReported) {
  WorldFixture run({makeFloorBox(), {"wall", {2, 0, -3}, {2.2, 3, 3}}});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", makeWalkTo(5, 0));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::blocked), 1);
  EXPECT_EQ(findEntityName(run.world, run.notices.back().obstacle), "wall");
  EXPECT_TRUE(run.hasTouched("wall"));
  // The wall, minus the radius, minus a gap between one and two contact offsets.
  EXPECT_LT(run.getFeet("ann").x(), 1.7 - run.world.settings().contactOffset * 0.8);
  EXPECT_GT(run.getFeet("ann").x(), 1.7 - run.world.settings().contactOffset * 2);
  EXPECT_EQ(run.worstPenetration, 0);
  const bool blocked = std::any_of(run.events.begin(), run.events.end(), [](const auto& e) {
    return e.kind == ContactEvent::Kind::blocked;
  });
  EXPECT_TRUE(blocked);
}

TEST(World, ASlantedPathSlidesAlongAWall) {
  WorldFixture run({makeFloorBox(), {"wall", {2, 0, -9}, {2.2, 3, 9}}});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", makeWalkTo(3, 6));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::blocked), 1);
  EXPECT_NEAR(run.getFeet("ann").z(), 6, 0.05);
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(World, StepsUpToTheStepHeightAreClimbedAndHigherOnesBlock) {
  WorldFixture run(
      {makeFloorBox(), {"low", {2, 0, -3}, {4, 0.29, 3}}, {"high", {4, 0, -3}, {6, 0.65, 3}}});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", Walk{{{3, 0.29, 0}, {5, 0.65, 0}}, 1.5});
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::blocked), 1);
  EXPECT_NEAR(run.getFeet("ann").y(), 0.29, 0.001);
  EXPECT_GT(run.getFeet("ann").x(), 3.5);
  EXPECT_EQ(run.worstPenetration, 0);
}

/// The highest ledge that an avatar can walk up.
double findHighestClimbedLedge(const WorldSettings& settings, const std::vector<double>& ledges) {
  constexpr double kApart = 2;
  std::vector<NamedBox> boxes{{"ground", {-1, -1, -1}, {4, 0, 20}}};
  double z = 0;
  for (const double height : ledges) {
    boxes.push_back({"ledge" + std::to_string(height), {1, 0, z - 0.95}, {3, height, z + 0.95}});
    z += kApart;
  }
  WorldFixture run(boxes, settings);
  z = 0;
  for (const double height : ledges) {
    run.order("of" + std::to_string(height), Spawn{{0, 0, z}});
    run.order("of" + std::to_string(height), Walk{{{2, height, z}}, 1.5});
    z += kApart;
  }
  run.runUntilIdle();
  EXPECT_EQ(run.worstPenetration, 0);
  double highest = 0;
  for (const double height : ledges) {
    const double feet = run.getFeet("of" + std::to_string(height)).y();
    if (feet < 0.5 * height) continue;
    EXPECT_NEAR(feet, height, 2 * settings.contactOffset);
    highest = std::max(highest, height);
  }
  return highest;
}

TEST(World, NoLedgeHigherThanAStepIsClimbed) {
  EXPECT_EQ(findHighestClimbedLedge({}, {0.05, 0.25, 0.295, 0.3, 0.305, 0.33, 0.35}), 0.3);
  WorldSettings low;
  low.stepHeight = 0.1;
  EXPECT_EQ(findHighestClimbedLedge(low, {0.01, 0.06, 0.095, 0.1, 0.105, 0.13, 0.15}), 0.1);
}

TEST(World, StepsAreClimbedWhateverSlopeIs) {
  for (const double degrees : {1.0, 5.0, 20.0, 33.0, 34.0}) {
    WorldSettings settings;
    settings.walkableNormalY = std::cos(degrees * 0.017453292519943295);
    EXPECT_EQ(findHighestClimbedLedge(settings, {0.01, 0.05, 0.17, 0.25, 0.295, 0.305, 0.33}),
              0.295)
        << degrees;
  }
}

TEST(World, ASkirtingBoardIsNoStep) {
  WorldFixture run({makeFloorBox(),
                    {"skirting", {1.98, 0, -3}, {2, 0.1, 3}},
                    {"wall", {2, 0, -3}, {2.2, 3, 3}}});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", makeWalkTo(5, 0));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::blocked), 1);
  EXPECT_LT(run.getFeet("ann").y(), 0.001);
}

std::vector<NamedBox> makeStair(double riser, double tread, int steps) {
  std::vector<NamedBox> boxes{makeFloorBox()};
  for (int i = 0; i < steps; ++i)
    boxes.push_back({"step" + std::to_string(i + 1),
                     {tread * i, -0.1, -1},
                     {tread * (i + 1) + (i + 1 == steps ? 2 : 0), riser * (i + 1), 1}});
  return boxes;
}

TEST(World, AStairIsWalkedUpAndDown) {
  for (const auto& [riser, tread] : {std::pair{0.17, 0.29}, {0.2, 0.2}, {0.1, 0.4}, {0.28, 0.25}}) {
    WorldFixture run(makeStair(riser, tread, 12));
    const double top = 12 * riser, end = 12 * tread + 1;
    run.order("ann", Spawn{{-2, 0, 0}});
    run.order("ann", makeWalkTo(end, 0, 1.4, top));
    run.runUntilIdle();
    EXPECT_EQ(run.count(Kind::arrived), 1) << riser;
    EXPECT_NEAR(run.getFeet("ann").y(), top, 0.001) << riser;
    run.order("ann", makeWalkTo(-2, 0));
    run.runUntilIdle();
    EXPECT_EQ(run.count(Kind::arrived), 2) << riser;
    EXPECT_NEAR(run.getFeet("ann").y(), 0, 0.001) << riser;
    EXPECT_EQ(run.worstPenetration, 0) << riser;
  }
}

TEST(World, ALedgeIsFallenFromAndLandedBelow) {
  WorldFixture run({makeFloorBox(), {"platform", {-3, 0, -3}, {0, 2, 3}}});
  run.order("ann", Spawn{{-1, 2, 0}});
  run.order("ann", makeWalkTo(3, 0));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::arrived), 1);
  EXPECT_LT(run.getFeet("ann").y(), 0.001);
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(World, FallingOutOfTheSceneIsLeavingIt) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{9, 0, 0}});
  run.order("ann", makeWalkTo(30, 0));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::left), 1);
  EXPECT_TRUE(run.open.empty());
}

TEST(World, AvatarsBlockEachOtherAndTouch) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{-3, 0, 0}});
  run.order("bob", Spawn{{3, 0, 0}});
  run.order("ann", makeWalkTo(3, 0));
  run.order("bob", makeWalkTo(-3, 0));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::blocked), 2);
  EXPECT_GE(run.getFeet("bob").x() - run.getFeet("ann").x(), 0.6);
  EXPECT_LT(run.getFeet("bob").x() - run.getFeet("ann").x(), 0.602);
  EXPECT_TRUE(run.hasTouched("bob"));
  EXPECT_EQ(run.worstPenetration, 0);
}

TEST(World, AnAvatarBlockedByAnotherGetsDistanceAndPoint) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{-3, 0, 0}});
  run.order("bob", Spawn{{3, 0, 0}});
  run.order("ann", makeWalkTo(3, 0));
  run.order("bob", makeWalkTo(-3, 0));
  run.runUntilIdle();
  int blocked = 0;
  for (const ContactEvent& e : run.events) {
    if (e.kind != ContactEvent::Kind::blocked) continue;
    ++blocked;
    const double towards = findEntityName(run.world, e.a) == "ann" ? 1 : -1;
    EXPECT_NEAR(e.separation.normal.x(), towards, 1e-6);
    EXPECT_GT(e.separation.distance, 0.8 * run.world.settings().contactOffset);
    EXPECT_LT(e.separation.distance, 2 * run.world.settings().contactOffset);
    EXPECT_NEAR(e.separation.pointA.x(),
                run.getFeet(findEntityName(run.world, e.a)).x() + 0.3 * towards, 1e-3);
    EXPECT_NEAR((e.separation.pointB - e.separation.pointA).norm(), e.separation.distance, 1e-12);
  }
  EXPECT_EQ(blocked, 2);
}

TEST(World, AVerySlowWalkArrives) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", makeWalkTo(0.03, 0, 0.001));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::arrived), 1);
  EXPECT_EQ(run.count(Kind::blocked), 0);
}

TEST(World, AWalkToAPlaceOverheadIsBlockedByNothingOfTheLastWalk) {
  WorldFixture run({makeFloorBox(), {"wall", {2, 0, -3}, {2.2, 3, 3}}});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", makeWalkTo(5, 0));
  run.runUntilIdle();
  EXPECT_NE(run.notices.back().obstacle, 0u);
  run.order("ann", makeWalkTo(run.getFeet("ann").x(), run.getFeet("ann").z(), 1.5, 3));
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::blocked), 2);
  EXPECT_EQ(run.notices.back().obstacle, 0u);
}

TEST(World, APaneOfNoThicknessIsNotCrossedAtAnySpeed) {
  Model model = makeBoxModel({makeFloorBox()});
  Mesh pane;
  pane.positions = {{2, 0, -9}, {2, 0, 9}, {2, 3, 9}, {2, 3, -9}};
  pane.indices = {0, 1, 2, 0, 2, 3};
  model.meshes.push_back(pane);
  model.objects.push_back({"pane", "", {1}, Eigen::Affine3d::Identity()});
  const auto scene = std::make_shared<const Scene>(model);
  for (const double speed : {0.5, 10.0, 1000.0}) {
    World world(scene);
    ASSERT_FALSE(submitAvatarCommand(world, {"ann", Spawn{{0, 0, 0}}, 0}));
    ASSERT_FALSE(submitAvatarCommand(world, {"ann", Walk{{{8, 0, 0}}, speed}, 0}));
    for (int i = 0; i < 600; ++i) ASSERT_EQ(tickWorld(world).maxPenetration, 0);
    EXPECT_LT(world.snapshot()->avatars[0].footPosition.x(), 1.7) << speed;
    EXPECT_GT(world.snapshot()->avatars[0].footPosition.x(), 1.69) << speed;
  }
}

TEST(World, ASteepRoofPushesNoAvatarThroughTheAdjacentWall) {
  // A fast fall onto a slope of 60 degrees continues sideways, towards a pane that was not close
  // before.
  Model model = makeBoxModel({makeFloorBox()});
  Mesh roof;
  roof.positions = {{-1, 2.4F, -3}, {-1, 2.4F, 3}, {0.4F, 0, 3}, {0.4F, 0, -3}};
  roof.indices = {0, 1, 2, 0, 2, 3};
  Mesh pane;
  pane.positions = {{0.42F, 0, -3}, {0.42F, 0, 3}, {0.42F, 9, 3}, {0.42F, 9, -3}};
  pane.indices = {0, 1, 2, 0, 2, 3};
  model.meshes.insert(model.meshes.end(), {roof, pane});
  model.objects.push_back({"roof", "", {1}, Eigen::Affine3d::Identity()});
  model.objects.push_back({"pane", "", {2}, Eigen::Affine3d::Identity()});
  const auto scene = std::make_shared<const Scene>(model);
  for (double height = 50; height < 51; height += 0.07) {
    World world(scene);
    ASSERT_FALSE(submitAvatarCommand(world, {"ann", Spawn{{0, height, 0}}, 0}));
    for (int i = 0; i < 300; ++i) {
      ASSERT_EQ(tickWorld(world).maxPenetration, 0) << height << " m, tick " << i;
      ASSERT_LT(world.snapshot()->avatars[0].footPosition.x(), 0.12) << height << " m, tick " << i;
    }
    EXPECT_LT(world.snapshot()->avatars[0].footPosition.y(), 3) << height;
  }
}

TEST(World, ARoomOfNoiseIsNeverPenetratedAndEventsBalance) {
  std::mt19937_64 random(5);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  std::vector<NamedBox> boxes{makeFloorBox()};
  for (int i = 0; i < 120; ++i) {
    const double x = uniform(-9, 9), z = uniform(-9, 9), y = uniform(0, 0.6);
    const double w = uniform(0.01, 0.8), h = uniform(0.01, 1.5), d = uniform(0.01, 0.8);
    boxes.push_back({"box" + std::to_string(i), {x, y, z}, {x + w, y + h, z + d}});
  }
  WorldFixture run(boxes);
  for (int i = 0; i < 6; ++i) {
    const std::string name = "a" + std::to_string(i);
    run.order(name, Spawn{{uniform(-8, 8), 3, uniform(-8, 8)}});
    for (int k = 0; k < 6; ++k) {
      const double x = uniform(-9, 9), z = uniform(-9, 9);
      run.order(name, makeWalkTo(x, z, 2.5));
    }
  }
  run.runTicks(1500);
  EXPECT_EQ(run.worstPenetration, 0);
  EXPECT_GT(run.events.size(), 100u);
  for (const ContactEvent& e : endAllContacts(run.world, ContactEvent::Reason::shutdown))
    run.take(e);
  EXPECT_TRUE(run.open.empty());
}

TEST(World, WaitsLooksAndCapturesRunInTheirOrder) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", Look{{0, 1.6, -5}});
  run.order("ann", Capture{"north"});
  run.order("ann", Wait{0.5});
  run.order("ann", Leave{});
  std::uint64_t captured = 0, left = 0;
  for (int i = 0; i < 60; ++i) {
    const TickReport report = run.step();
    for (const Notice& n : report.notices) {
      if (n.kind == Kind::capture) {
        captured = report.snapshot->tick;
        EXPECT_EQ(n.text, "north");
        EXPECT_NEAR(report.snapshot->avatars[0].viewDirection.z(), -1, 1e-3);
      }
      if (n.kind == Kind::left) left = report.snapshot->tick;
    }
  }
  EXPECT_EQ(captured, 2u);
  EXPECT_EQ(left, captured + 1 + 30);
  EXPECT_TRUE(run.open.empty());
  EXPECT_EQ(run.events.back().reason, ContactEvent::Reason::left);
}

TEST(World, DriveActsAtOnceAndZeroStops) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runUntilIdle();
  run.order("ann", Drive{{1.2, 0, 0}});
  run.runTicks(60);
  EXPECT_NEAR(run.getFeet("ann").x(), 1.2, 1e-9);
  run.order("ann", Drive{});
  run.runTicks(10);
  EXPECT_NEAR(run.getFeet("ann").x(), 1.2, 1e-9);
}

TEST(World, ADriveOfAnAbsentAvatarIsRefusedAndReportsDroppedOrders) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("ann", makeWalkTo(1, 0));
  run.order("ann", Drive{{1.2, 0, 0}});
  run.runTicks(10);
  ASSERT_EQ(run.notices.size(), 3u);
  EXPECT_EQ(run.count(Kind::dropped), 2);
  EXPECT_EQ(run.notices[2].kind, Kind::refused);
  EXPECT_NE(run.notices[2].text.find("2 queued orders are dropped"), std::string::npos);
  EXPECT_TRUE(run.world.snapshot()->avatars.empty());
}

/// Tags of the cancelled orders, in order, each with the reason.
std::vector<std::uint64_t> listDroppedTags(const WorldFixture& run, const std::string& by) {
  std::vector<std::uint64_t> tags;
  for (const Notice& notice : run.notices) {
    if (notice.kind != Kind::dropped) continue;
    EXPECT_EQ(notice.text, by);
    tags.push_back(notice.tag);
  }
  return tags;
}

TEST(World, OrdersDroppedByADriveAreReportedWithTheirTags) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runUntilIdle();
  submitAvatarCommand(run.world, {"ann", makeWalkTo(3, 0), 7});
  submitAvatarCommand(run.world, {"ann", Wait{5}, 8});
  submitAvatarCommand(run.world, {"bob", Wait{5}, 9});
  run.runTicks(10);
  run.notices.clear();
  submitAvatarCommand(run.world, {"ann", Drive{{0, 0, 1}}, 10});
  run.runTicks(2);
  EXPECT_EQ(listDroppedTags(run, "by a Drive"), (std::vector<std::uint64_t>{7, 8}));
  EXPECT_EQ(run.notices[0].id, run.getView("ann").id);
  run.runTicks(60);
  EXPECT_EQ(run.count(Kind::arrived), 0);
}

TEST(World, OrdersAfterARefusedSpawnAreReportedAsDropped) {
  WorldFixture run({makeFloorBox(), {"block", {-1, 0, -1}, {1, 2, 1}}});
  submitAvatarCommand(run.world, {"ann", Spawn{{0, 0.5, 0}}, 1});
  submitAvatarCommand(run.world, {"ann", makeWalkTo(3, 0), 2});
  submitAvatarCommand(run.world, {"ann", Leave{}, 3});
  run.runTicks(2);
  EXPECT_EQ(run.count(Kind::refused), 1);
  EXPECT_EQ(listDroppedTags(run, "by a refused Spawn"), (std::vector<std::uint64_t>{2, 3}));
}

TEST(World, TheLastNoticeOfManyDroppedOrdersCountsTheOthers) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runUntilIdle();
  for (int i = 0; i < 10'500; ++i) run.order("ann", Wait{5});
  run.order("ann", Drive{});
  run.runTicks(1);
  EXPECT_EQ(run.count(Kind::dropped), 10'000);
  EXPECT_EQ(run.notices.back().text, "by a Drive, and 500 more orders");
}

TEST(World, ARespawnUnderTheSameNameIsAnotherAvatar) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 0, 0}});
  run.order("bob", Spawn{{0.7, 0, 0}});
  run.order("bob", makeWalkTo(0, 0));
  run.runTicks(30);
  EXPECT_TRUE(run.hasTouched("ann") || run.hasTouched("bob"));
  const EntityId before = run.world.snapshot()->avatars[0].id;
  run.order("ann", Leave{});
  run.order("ann", Spawn{{0, 0, 3}});
  run.runUntilIdle();
  EXPECT_EQ(run.count(Kind::arrived), 1) << "bob still has contacts with the avatar that left";
  ASSERT_EQ(run.world.snapshot()->avatars.size(), 2u);
  EXPECT_GT(run.world.snapshot()->avatars[1].id, before + 1);
  for (const ContactEvent& e : endAllContacts(run.world, ContactEvent::Reason::shutdown))
    run.take(e);
  EXPECT_TRUE(run.open.empty());
}

TEST(World, AWorldOfNothingTicksAndRefusesSpawns) {
  WorldFixture run(std::vector<NamedBox>{});
  run.runTicks(3);
  run.order("ann", Spawn{{0, 0, 0}});
  run.runTicks(3);
  EXPECT_EQ(run.count(Kind::refused), 1);
  EXPECT_TRUE(run.world.snapshot()->avatars.empty());
}

TEST(World, AbsurdCommandsAreRefusedByNameAndChangeNothing) {
  WorldFixture run({makeFloorBox()});
  const auto why = [&](Order o, const std::string& name = "ann") {
    const auto text = submitAvatarCommand(run.world, {name, std::move(o), 0});
    return text.value_or("taken");
  };
  EXPECT_NE(why(Spawn{{0, kNaN, 0}}).find("at.y is NaN"), std::string::npos);
  EXPECT_NE(why(Spawn{{0, 1e9, 0}}).find("at.y"), std::string::npos);
  EXPECT_NE(why(Spawn{{0, 0, 0}, kNaN}).find("facing"), std::string::npos);
  EXPECT_NE(why(Walk{{}, 1}).find("along"), std::string::npos);
  EXPECT_NE(why(Walk{{{0, 0, 0}, {0, 0, INFINITY}}, 1}).find("along[1].z"), std::string::npos);
  EXPECT_NE(why(makeWalkTo(1, 1, 0)).find("speed"), std::string::npos);
  EXPECT_NE(why(makeWalkTo(1, 1, 1e6)).find("speed"), std::string::npos);
  EXPECT_NE(why(Wait{-1}).find("seconds"), std::string::npos);
  EXPECT_NE(why(Capture{"../../etc"}).find("as"), std::string::npos);
  EXPECT_NE(why(Drive{{kNaN, 0, 0}}).find("velocity.x"), std::string::npos);
  EXPECT_NE(why(Leave{}, "a b").find("avatar"), std::string::npos);
  EXPECT_TRUE(run.step().idle);
  EXPECT_TRUE(run.notices.empty());
}

TEST(World, OrdersForAnAbsentAvatarAreRefusedWhenReached) {
  WorldFixture run({makeFloorBox()});
  run.order("ghost", makeWalkTo(1, 1));
  run.order("ghost", Drive{{1, 0, 0}});
  run.step();
  EXPECT_GE(run.count(Kind::refused), 1);
}

TEST(World, TheSameCommandsGiveTheSameHashAndOthersDoNot) {
  const auto computeHash = [](double speed) {
    WorldFixture run(makeStair(0.17, 0.29, 8));
    run.order("ann", Spawn{{-2, 0, 0}, 33});
    run.order("bob", Spawn{{-2, 0, 1.5}, 33});
    run.order("ann", makeWalkTo(4, 0.2, speed, 1.36));
    run.order("bob", makeWalkTo(4, 0, speed, 1.36));
    run.runTicks(400);
    return run.world.snapshot()->stateHash;
  };
  EXPECT_EQ(computeHash(1.5), computeHash(1.5));
  EXPECT_NE(computeHash(1.5), computeHash(1.5000000001));
}

TEST(World, ARestingAvatarCostsNoQueries) {
  WorldFixture run({makeFloorBox()});
  run.order("ann", Spawn{{0, 0, 0}});
  run.runUntilIdle();
  run.runTicks(3);
  EXPECT_EQ(run.step().narrowQueries, 0u);
  EXPECT_EQ(run.step().activeContacts, 1u);
}

TEST(World, NearMissesAreReportedOncePerApproach) {
  WorldSettings settings;
  settings.nearMissDistance = 0.05;
  WorldFixture run({makeFloorBox(), {"post", {0, 0, 0.33}, {0.1, 2, 0.4}}}, settings);
  run.order("ann", Spawn{{-2, 0, 0}});
  run.order("ann", makeWalkTo(2, 0));
  run.runUntilIdle();
  const auto nears = std::count_if(run.events.begin(), run.events.end(), [&](const auto& e) {
    return e.kind == ContactEvent::Kind::nearMiss && e.phase == ContactEvent::Phase::begin &&
           findEntityName(run.world, e.b) == "post";
  });
  EXPECT_EQ(nears, 1);
  EXPECT_FALSE(run.hasTouched("post"));
}

TEST(World, ANearMissEndsWithItsMinimumWhenTheAvatarLeaves) {
  WorldSettings settings;
  settings.nearMissDistance = 0.05;
  WorldFixture run({makeFloorBox(), {"post", {0, 0, 0.33}, {0.1, 2, 0.4}}}, settings);
  run.order("ann", Spawn{{-2, 0, 0}});
  run.order("ann", makeWalkTo(0, 0));
  run.runUntilIdle();
  run.order("ann", Leave{});
  run.runTicks(2);
  std::vector<ContactEvent> nears;
  for (const ContactEvent& e : run.events)
    if (e.kind == ContactEvent::Kind::nearMiss && e.b == 2) nears.push_back(e);
  ASSERT_EQ(nears.size(), 3u);
  using Phase = ContactEvent::Phase;
  EXPECT_EQ(nears[0].phase, Phase::begin);
  EXPECT_EQ(nears[1].phase, Phase::min);
  EXPECT_LE(nears[1].separation.distance, nears[0].separation.distance);
  EXPECT_EQ(nears[2].phase, Phase::end);
  EXPECT_EQ(nears[2].reason, ContactEvent::Reason::left);
}

}  // namespace
}  // namespace enfilade::scene
