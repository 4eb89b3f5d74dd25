#include "scene/navigation/walk/path_steps.hpp"

#include <gtest/gtest.h>

#include "scene/navigation/navigation.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

/// The heights of steps, in order.
std::vector<double> getRises(const std::vector<PathStep>& steps) {
  std::vector<double> rises;
  for (const PathStep& step : steps) rises.push_back(step.rise);
  return rises;
}

void expectRises(const std::vector<PathStep>& steps, const std::vector<double>& expected) {
  const std::vector<double> rises = getRises(steps);
  ASSERT_EQ(rises.size(), expected.size()) << ::testing::PrintToString(rises);
  for (std::size_t i = 0; i < rises.size(); ++i) EXPECT_NEAR(rises[i], expected[i], 2e-3) << i;
}

TEST(PathSteps, AStairAKerbAndAThresholdHaveTheirHeights) {
  std::vector<NamedBox> boxes{{"floor", {0, -0.2, 0}, {4, 0, 4}},
                              {"landing", {5.5, -0.2, 0}, {9, 1, 4}},
                              {"yard", {9, -0.2, 0}, {14, 0.9, 4}},
                              {"threshold", {11, 0.9, 0}, {11.1, 0.92, 4}}};
  for (int i = 0; i < 5; ++i)
    boxes.push_back({"stair", {4 + 0.3 * i, -0.2, 0}, {4.3 + 0.3 * i, 0.2 * (i + 1), 4}});
  Navigation navigation(makeBoxScene(boxes), {}, {});
  const NavigationPath path = navigation.findPath({1, 0, 2}, {13, 0.9, 2});
  ASSERT_TRUE(path.found()) << path.reason;
  const std::vector<PathStep> steps = navigation.findSteps(path.points);
  expectRises(steps, {0.2, 0.2, 0.2, 0.2, 0.2, -0.1, 0.02, -0.02});
  for (int i = 0; i < 5; ++i)
    EXPECT_NEAR(steps[static_cast<std::size_t>(i)].position.x(), 4 + 0.3 * i, 0.4);
  const NavigationPath back = navigation.findPath({13, 0.9, 2}, {1, 0, 2});
  ASSERT_TRUE(back.found()) << back.reason;
  expectRises(navigation.findSteps(back.points), {0.02, -0.02, 0.1, -0.2, -0.2, -0.2, -0.2, -0.2});
}

TEST(PathSteps, AWideAgentStandsHighAboveTheFloorOfAStair) {
  std::vector<NamedBox> boxes{{"floor", {0, -0.2, 0}, {4, 0, 4}}};
  for (int i = 0; i < 8; ++i)
    boxes.push_back({"stair", {4 + 0.25 * i, -0.2, 0}, {12, 0.18 * (i + 1), 4}});
  Navigation navigation(makeBoxScene(boxes), {}, {.radius = 0.8});
  const NavigationPath path = navigation.findPath({1, 0, 2}, {9, 1.44, 2});
  ASSERT_TRUE(path.found()) << path.reason;
  expectRises(navigation.findSteps(path.points), std::vector<double>(8, 0.18));
}

/// A kerb with an inclined riser: from (6, 0) to (6 + `run`, 0.15).
Model makeInclinedKerb(float run) {
  Model model =
      makeBoxModel({{"street", {0, -0.2, 0}, {6.2, 0, 4}}, {"kerb", {6, -0.2, 0}, {12, 0.15, 4}}});
  for (Eigen::Vector3f& corner : model.meshes.back().positions)
    if (corner.x() < 7 && corner.y() > 0) corner.x() += run;
  return model;
}

TEST(PathSteps, AnInclinedRiserIsOneStep) {
  for (const float run : {0.013f, 0.026f, 0.04f, 0.09f}) {
    SCOPED_TRACE(run);
    Navigation navigation(std::make_shared<const Scene>(makeInclinedKerb(run)), {}, {});
    for (const double end : {0.6, 3.4}) {
      SCOPED_TRACE(end);
      const NavigationPath up = navigation.findPath({4, 0, 2}, {8, 0.15, end});
      ASSERT_TRUE(up.found()) << up.reason;
      expectRises(navigation.findSteps(up.points), {0.15});
      const NavigationPath down = navigation.findPath({8, 0.15, end}, {4, 0, 2});
      ASSERT_TRUE(down.found()) << down.reason;
      expectRises(navigation.findSteps(down.points), {-0.15});
    }
  }
}

TEST(PathSteps, ARiserThatIsCrossedObliquelyIsAStep) {
  const auto scene = std::make_shared<const Scene>(makeInclinedKerb(0.07f));  // 65 degrees
  const World world(scene);
  std::vector<Vec3> traced;  // the line rises by 48 degrees there
  for (int i = 0; i <= 40; ++i) {
    const double x = 5.2 + 0.045 * i;
    traced.emplace_back(x, x < 5.8 ? 0 : 0.15, 0.5 + 0.075 * i);
  }
  expectRises(findSteps(world.data(), {}, traced), {0.15});
}

TEST(PathSteps, AGrooveBetweenTheFeetIsNoStep) {
  Navigation navigation(makeBoxScene({{"floor", {0, -0.2, 0}, {3, 0, 4}},
                                      {"left", {3, -0.2, 0}, {6, 0, 1.9}},
                                      {"right", {3, -0.2, 2.1}, {6, 0, 4}},
                                      {"bottom", {3, -0.2, 1.9}, {6, -0.1, 2.1}},
                                      {"behind", {6, -0.2, 0}, {9, 0, 4}}}),
                        {}, {});
  const NavigationPath path = navigation.findPath({1, 0, 2}, {8, 0, 2});
  ASSERT_TRUE(path.found()) << path.reason;
  EXPECT_NEAR(path.length, 7, 1e-3) << "along the groove";
  expectRises(navigation.findSteps(path.points), {});
}

TEST(PathSteps, AJointInARampIsNoStep) {
  const float slope = 0.25f;
  Model model = makeBoxModel({{"floor", {0, -0.2, 0}, {4, 0, 4}},
                              {"ramp/a", {4, -0.2, 0}, {6, 0, 4}},
                              {"ramp/b", {6.05, -0.2, 0}, {8, 0, 4}},
                              {"under", {5, -0.2, 0}, {7, 0.2, 4}}});
  for (std::size_t i = 1; i < 3; ++i)
    for (Eigen::Vector3f& corner : model.meshes[i].positions)
      corner.y() += slope * (corner.x() - 4);
  Navigation navigation(std::make_shared<const Scene>(std::move(model)), {}, {});
  const NavigationPath path = navigation.findPath({1, 0, 2}, {7, 0.9, 2});
  ASSERT_TRUE(path.found()) << path.reason;
  expectRises(navigation.findSteps(path.points), {});
}

TEST(PathSteps, ARampAndANarrowGapAreNoSteps) {
  std::vector<NamedBox> boxes{{"floor", {0, -0.2, 0}, {4, 0, 4}},
                              {"floor/behind", {4.1, -0.2, 0}, {8, 0, 4}},
                              {"bottom", {4, -0.2, 0}, {4.1, -0.1, 4}}};
  boxes.push_back({"ramp", {8, -0.2, 0}, {12, 0, 4}});
  Model model = makeBoxModel(boxes);
  for (Eigen::Vector3f& corner : model.meshes.back().positions)
    corner.y() += 0.75f * (corner.x() - 8);
  Navigation navigation(std::make_shared<const Scene>(std::move(model)), {}, {});
  const NavigationPath path = navigation.findPath({1, 0, 2}, {10, 1.75, 2});
  ASSERT_TRUE(path.found()) << path.reason;
  expectRises(navigation.findSteps(path.points), {});
}

TEST(PathSteps, AFallIsNoStep) {
  Navigation navigation(
      makeBoxScene({{"roof", {0, -0.2, 0}, {4, 1, 4}}, {"yard", {4, -0.2, 0}, {9, 0, 4}}}), {}, {});
  const NavigationPath path = navigation.findPath({1, 1, 2}, {8, 0, 2}, {.maxDrop = 2});
  ASSERT_TRUE(path.found()) << path.reason;
  expectRises(navigation.findSteps(path.points), {});
}

}  // namespace
}  // namespace enfilade::scene::testing
