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
                              {"threshold", {11, 0.9, 0}, {11.1, 0.93, 4}}};
  for (int i = 0; i < 5; ++i)
    boxes.push_back({"stair", {4 + 0.3 * i, -0.2, 0}, {4.3 + 0.3 * i, 0.2 * (i + 1), 4}});
  Navigation navigation(boxScene(boxes), {}, {});
  const NavigationPath path = navigation.findPath({1, 0, 2}, {13, 0.9, 2});
  ASSERT_TRUE(path.found()) << path.reason;
  const std::vector<PathStep> steps = navigation.findSteps(path.points);
  expectRises(steps, {0.2, 0.2, 0.2, 0.2, 0.2, -0.1, 0.03, -0.03});
  for (int i = 0; i < 5; ++i)
    EXPECT_NEAR(steps[static_cast<std::size_t>(i)].position.x(), 4 + 0.3 * i, 0.4);
  const NavigationPath back = navigation.findPath({13, 0.9, 2}, {1, 0, 2});
  ASSERT_TRUE(back.found()) << back.reason;
  expectRises(navigation.findSteps(back.points), {0.03, -0.03, 0.1, -0.2, -0.2, -0.2, -0.2, -0.2});
}

TEST(PathSteps, ARampAndANarrowGapAreNoSteps) {
  std::vector<NamedBox> boxes{{"floor", {0, -0.2, 0}, {4, 0, 4}},
                              {"floor/behind", {4.1, -0.2, 0}, {8, 0, 4}},
                              {"bottom", {4, -0.2, 0}, {4.1, -0.1, 4}}};
  boxes.push_back({"ramp", {8, -0.2, 0}, {12, 0, 4}});
  Model model = boxModel(boxes);
  for (Eigen::Vector3f& corner : model.meshes.back().positions)
    corner.y() += 0.75f * (corner.x() - 8);
  Navigation navigation(std::make_shared<const Scene>(std::move(model)), {}, {});
  const NavigationPath path = navigation.findPath({1, 0, 2}, {10, 1.75, 2});
  ASSERT_TRUE(path.found()) << path.reason;
  expectRises(navigation.findSteps(path.points), {});
}

TEST(PathSteps, AFallIsNoStep) {
  Navigation navigation(
      boxScene({{"roof", {0, -0.2, 0}, {4, 1, 4}}, {"yard", {4, -0.2, 0}, {9, 0, 4}}}), {}, {});
  const NavigationPath path = navigation.findPath({1, 1, 2}, {8, 0, 2}, {.maxDrop = 2});
  ASSERT_TRUE(path.found()) << path.reason;
  expectRises(navigation.findSteps(path.points), {});
}

}  // namespace
}  // namespace enfilade::scene::testing
