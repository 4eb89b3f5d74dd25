// Reasons why no path leads somewhere.
#include "scene/navigation/unreachable_reasons.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "scene/navigation/navigation.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene::testing {
namespace {

TEST(UnreachableReasons, NameWhatStopsTheAgentAndWhatItWouldNeed) {
  const NamedBox floor{"floor", {0, -0.2, 0}, {10, 0, 5}};
  const auto findReason = [](const std::vector<NamedBox>& boxes, const Vec3& goal) {
    return Navigation(makeBoxScene(boxes), {}, {}).findPath({2, 0, 2}, goal).reason;
  };
  EXPECT_EQ(findReason({floor, {"wall", {5, 0, -1}, {5.2, 2.5, 6}}}, {8, 0, 2}),
            "wall is in the way: no gap, needs 0.600 m");
  EXPECT_EQ(findReason({floor, {"kerb", {5, 0, 0}, {10, 0.4, 5}}}, {8, 0.4, 2}),
            "kerb is in the way: a step of 0.400 m, climbs 0.300");
  EXPECT_EQ(findReason({floor, {"beam", {5, 1.5, -1}, {5.3, 3, 6}}}, {8, 0, 2}),
            "beam is in the way: clear height 1.500 m, needs 1.750");
  EXPECT_EQ(findReason({floor, {"low", {0, -2.2, 5}, {10, -2, 10}}}, {5, -2, 8}),
            "the floor ends: the next one is 2.00 m lower");
  EXPECT_EQ(findReason({floor, {"island", {14, -0.2, 0}, {18, 0, 5}}}, {16, 0, 2}),
            "no floor, step or stair leads there");
}

TEST(UnreachableReasons, AreThoseOfTheFirstRoomOnTheWay) {
  std::vector<NamedBox> boxes{{"floor", {0, -0.2, 0}, {15, 0, 5}},
                              {"kerb", {5, 0, -1}, {5.4, 0.5, 6}},
                              {"wall", {10, 0, -1}, {10.2, 2.5, 6}}};
  Navigation navigation(makeBoxScene(boxes), {}, {});
  EXPECT_EQ(navigation.findPath({2, 0, 2}, {13, 0, 2}).reason,
            "kerb is in the way: a step of 0.500 m, climbs 0.300");
  EXPECT_EQ(navigation.findPath({13, 0, 2}, {2, 0, 2}).reason,
            "wall is in the way: no gap, needs 0.600 m");
}

/// A strip of floor belongs to the other room and runs behind a panel of this one: no agent fits.
TEST(UnreachableReasons, AreOfPlacesWhereAnAgentFits) {
  Navigation navigation(makeBoxScene({{"floor", {0, -0.2, -1}, {10, 0, 5}},
                                      {"facade", {-1, 0, -1}, {11, 2.5, 0}},
                                      {"panel", {-1, 0, 0.15}, {5, 2.5, 0.2}},
                                      {"party", {5, 0, 0.15}, {5.4, 2.5, 6}}}),
                        {}, {});
  for (const auto& [from, to] : {std::pair(2, 8), std::pair(8, 2)}) {
    const std::string reason = navigation.findPath(Vec3(from, 0, 2), Vec3(to, 0, 2)).reason;
    EXPECT_TRUE(reason.starts_with("party is in the way: ")) << reason;
  }
}

TEST(UnreachableReasons, TheFirstPathThatIsNotFoundReportsTheirMesh) {
  Navigation navigation(
      makeBoxScene({{"floor", {0, -0.2, 0}, {40, 0, 5}}, {"wall", {5, 0, -1}, {5.2, 2.5, 6}}}), {},
      {});
  std::vector<double> shares;
  const auto find = [&](const Vec3& goal) {
    shares.clear();
    return navigation.findPath({2, 0, 2}, goal, {}, [&](double share) { shares.push_back(share); });
  };
  EXPECT_TRUE(find({4, 0, 2}).found());
  EXPECT_TRUE(shares.empty());
  EXPECT_EQ(find({8, 0, 2}).reason, "wall is in the way: no gap, needs 0.600 m");
  ASSERT_FALSE(shares.empty());
  EXPECT_LT(shares.front(), 1);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_EQ(shares.back(), 1);
  EXPECT_EQ(find({9, 0, 2}).reason, "wall is in the way: no gap, needs 0.600 m");
  EXPECT_TRUE(shares.empty());
}

}  // namespace
}  // namespace enfilade::scene::testing
