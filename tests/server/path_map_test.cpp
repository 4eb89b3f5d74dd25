#include "server/plans/path_map.hpp"

#include <gtest/gtest.h>

#include "server/plans/path_style.hpp"
#include "tests/server/small_room.hpp"

namespace enfilade::server::testing {
namespace {

WalkedPath makePathAt(std::initializer_list<std::pair<double, int>> heightsAndTicks) {
  WalkedPath path{"ann", {}, 1};
  for (const auto& [height, ticks] : heightsAndTicks) {
    for (int i = 0; i < ticks; ++i) path.footPositions.push_back(Vec3(i, height, 0));
  }
  return path;
}

TEST(PathMap, StoreysAreTheHeightsWalkedOnForLong) {
  EXPECT_TRUE(findWalkedStoreys({}).empty());
  EXPECT_EQ(findWalkedStoreys({makePathAt({{0.0005, 100}})}), std::vector<double>{0.0005});
  const auto two = findWalkedStoreys({makePathAt({{0, 300}, {1.1, 5}, {2.2, 5}, {4.2, 200}})});
  EXPECT_EQ(two, (std::vector<double>{0, 4.2})) << "stairs are no storey";
}

TEST(PathMap, AStandingAvatarDefinesNoStorey) {
  WalkedPath waiting{"bob", std::vector<Vec3>(5000, Vec3(0, 0, 0)), 2};
  const auto two = findWalkedStoreys({makePathAt({{0, 100}, {4.2, 50}}), waiting});
  EXPECT_EQ(two, (std::vector<double>{0, 4.2}));
}

TEST(PathMap, PathsAreDrawnInTheirOwnColourOnThePlan) {
  WalkTrace trace;
  trace.paths = {makePathAt({{0, 50}})};
  int plans = 0;
  const auto blank = [&](const render::Camera& camera) -> std::optional<PlanPicture> {
    ++plans;
    const std::size_t pixels = static_cast<std::size_t>(camera.width * camera.height);
    PlanPicture plan{{camera.width, camera.height, {}}, std::vector<std::uint32_t>(pixels, 1)};
    plan.colour.rgb.assign(3 * pixels, 200);
    return plan;
  };
  const auto map = drawMap(trace, {blank});
  ASSERT_TRUE(map);
  EXPECT_EQ(plans, 1);
  std::size_t blue = 0;
  for (std::size_t i = 0; i < map->rgb.size(); i += 3) {
    blue += map->rgb[i + 2] > 200 && map->rgb[i] < 60;
  }
  EXPECT_GT(blue, 1000u);
  EXPECT_FALSE(drawMap(trace, {[](const auto&) { return std::optional<PlanPicture>(); }}));
  // An earlier walk of the same avatar is paler, and no other avatar's.
  const render::Colour own = computeAvatarColour(trace.paths[0].id);
  const auto countPale = [&](const render::Image& image) {
    std::size_t pale = 0;
    for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
      bool isPale = true;
      for (std::size_t k = 0; k < 3; ++k) isPale = isPale && image.rgb[i + k] == (own[k] + 255) / 2;
      pale += isPale ? 1 : 0;
    }
    return pale;
  };
  EXPECT_EQ(countPale(*map), 0u);
  trace.paths[0].isEarlier = true;
  EXPECT_GT(countPale(drawMap(trace, {blank}).value()), 300u);
  trace.paths[0].isEarlier = false;
  // The blank image lacks the room's walls; the map shows them dark.
  const auto countInk = [](const render::Image& image) {
    std::size_t ink = 0;
    for (std::size_t i = 0; i < image.rgb.size(); i += 3) ink += image.rgb[i] < 80;
    return ink;
  };
  const auto room = makeSmallRoom();
  EXPECT_GT(countInk(drawMap(trace, {blank, makeFloorPlanSource(room)}).value()),
            countInk(*map) + 500);
}

TEST(PathMap, BlockedWalksAndRefusedOrdersAreDrawn) {
  const auto countMarks = [](const WalkTrace& trace) {
    const auto blank = [](const render::Camera& camera) -> std::optional<PlanPicture> {
      const std::size_t pixels = static_cast<std::size_t>(camera.width * camera.height);
      PlanPicture plan{{camera.width, camera.height, {}}, std::vector<std::uint32_t>(pixels, 1)};
      plan.colour.rgb.assign(3 * pixels, 200);
      return plan;
    };
    const render::Image map = drawMap(trace, {blank}).value();
    std::size_t marked = 0;
    for (std::size_t i = 0; i < map.rgb.size(); i += 3) {
      bool isMark = true;
      for (std::size_t k = 0; k < 3; ++k) isMark = isMark && map.rgb[i + k] == kBlockedColour[k];
      marked += isMark ? 1 : 0;
    }
    return marked;
  };
  WalkTrace trace;
  trace.paths = {makePathAt({{0, 50}})};
  EXPECT_EQ(countMarks(trace), 0u);
  // The legend has one mark for both kinds; the map has one for each.
  trace.blockedWalks = {{Vec3(10, 0, 2), Vec3::UnitX()}};
  const std::size_t one = countMarks(trace);
  trace.refusedOrders = {{Vec3(20, 0, 2), Vec3::UnitX()}};
  EXPECT_GT(one, 50u);
  EXPECT_GT(countMarks(trace), one + 20);
}

TEST(PathMap, ARefusedOrderFarAwayDoesNotStretchTheMap) {
  const auto measureWidth = [](const std::vector<Vec3>& refused) {
    WalkTrace trace;
    trace.paths = {makePathAt({{0, 50}})};
    for (const Vec3& at : refused) trace.refusedOrders.push_back({at, Vec3::UnitX()});
    double width = 0;
    const auto blank = [&](const render::Camera& camera) -> std::optional<PlanPicture> {
      width = camera.heightY * camera.width / camera.height;
      const std::size_t pixels = static_cast<std::size_t>(camera.width * camera.height);
      PlanPicture plan{{camera.width, camera.height, {}}, std::vector<std::uint32_t>(pixels, 1)};
      plan.colour.rgb.assign(3 * pixels, 200);
      return plan;
    };
    EXPECT_TRUE(drawMap(trace, {blank}));
    return width;
  };
  const double walked = measureWidth({});  // from 0 to 49 m
  EXPECT_NEAR(measureWidth({Vec3(60, 0, 0)}), walked + 11, 0.5);
  EXPECT_EQ(measureWidth({Vec3(5000, 0, 0)}), walked);
}

}  // namespace
}  // namespace enfilade::server::testing
