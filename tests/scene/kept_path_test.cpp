// Kept paths: an agent on its way asks for its path again and again. A kept path is about as short
// as a new one, and can be walked.
#include <gtest/gtest.h>

#include <random>

#include "scene/navigation/doors.hpp"
#include "scene/navigation/navigation.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

constexpr double kHallHeight = 2.5;  // metres

/// A floor of 12 x 8 m. Two ways lead around the wall in its middle.
std::vector<NamedBox> makeHallWithWall() {
  return {{"floor", {-6, -0.2, -4}, {6, 0, 4}}, {"wall", {-3, 0, -0.1}, {3, kHallHeight, 0.1}}};
}

bool isPathWalked(Navigation& navigation, const NavigationPath& path) {
  for (std::size_t i = 1; i < path.points.size(); ++i) {
    const auto end = navigation.tryStep(path.points[i - 1], path.points[i], false);
    if (!end || (*end - path.points[i]).norm() > 2e-3) return false;
  }
  return true;
}

/// The results of an agent that asks for its path at each place.
struct KeptJourney {
  int searches = 0;
  double maxExcess = -1;  ///< of the length of a new path, the largest of all places
};

KeptJourney compareWithNew(Navigation& navigation, const std::vector<Vec3>& places,
                           const Vec3& goal) {
  KeptJourney journey;
  std::optional<KeptPath> kept;
  std::optional<Vec3> searchedFrom;
  for (const Vec3& place : places) {
    const NavigationPath path = navigation.findPathAgain(place, goal, kept);
    const NavigationPath fresh = navigation.findPath(place, goal);
    EXPECT_EQ(path.found(), fresh.found());
    if (!path.found()) continue;
    EXPECT_LT((path.points.front() - fresh.points.front()).norm(), 1e-3);
    EXPECT_LT((path.points.back() - fresh.points.back()).norm(), 1e-3);
    EXPECT_NEAR(path.length, computeLength(path.points), 1e-12);
    EXPECT_EQ(path.legs.size(), 1u);
    EXPECT_NEAR(path.legs.front().length, path.length, 1e-12);
    EXPECT_TRUE(isPathWalked(navigation, path)) << place.transpose();
    journey.searches += searchedFrom != kept->searchedFrom;
    searchedFrom = kept->searchedFrom;
    journey.maxExcess = std::max(journey.maxExcess, path.length / fresh.length - 1);
  }
  return journey;
}

/// Places of a walk with random turns on the floor; it slides along obstacles.
std::vector<Vec3> wander(Navigation& navigation, const Vec3& start, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> turn(-0.6, 0.6);
  std::vector<Vec3> places{start};
  double heading = 0;
  for (int i = 0; i < count; ++i) {
    heading += turn(random);
    const Vec3 step(0.15 * std::cos(heading), 0, 0.15 * std::sin(heading));
    const auto next = navigation.tryStep(places.back(), places.back() + step, true);
    if (next && std::abs(next->y()) < 0.01 && (*next - places.back()).norm() > 0.05)
      places.push_back(*next);
    else
      heading += 2;
  }
  return places;
}

TEST(KeptPath, OfAWandererIsAsShortAsANewOneAndRarelySearched) {
  Navigation navigation(makeBoxScene(makeHallWithWall()), {}, {});
  for (const unsigned seed : {1u, 2u}) {
    const KeptJourney journey =
        compareWithNew(navigation, wander(navigation, {0, 0, -2}, 200, seed), {0.2, 0, 2});
    EXPECT_LT(journey.maxExcess, 0.02) << seed;
    EXPECT_LT(journey.searches, 60) << seed;
  }
}

TEST(KeptPath, ChangesToTheOtherWayWhereThatIsShorter) {
  Navigation navigation(makeBoxScene(makeHallWithWall()), {}, {});
  std::vector<Vec3> places;
  for (int i = 0; i <= 60; ++i) places.push_back({-3 + 0.1 * i, 0, -1});
  const KeptJourney journey = compareWithNew(navigation, places, {0, 0, 1});
  EXPECT_LT(journey.maxExcess, 0.02);
  EXPECT_GE(journey.searches, 2);
  EXPECT_LT(journey.searches, 20);
}

/// An agent overshoots the points of its path by up to a step. It is led on, not back. Around the
/// wall the path is much longer than the way across, and a rug keeps points out of clear sight.
TEST(KeptPath, LeadsAnAgentOnThatOvershootsItsPoints) {
  constexpr double kStep = 0.14;
  std::vector<NamedBox> boxes = makeHallWithWall();
  for (int i = 0; i < 8; ++i)
    boxes.push_back({"rug/" + std::to_string(i), {-3.0 + i, 0, 0.3}, {-2.4 + i, 0.004, 2.6}});
  Navigation navigation(makeBoxScene(boxes), {}, {});
  const Vec3 goal(-2, 0, 2);
  std::optional<KeptPath> kept;
  Vec3 place(-0.5, 0, -1);
  int steps = 0;
  for (; (place - goal).norm() > 0.2 && steps < 100; ++steps) {
    const NavigationPath path = navigation.findPathAgain(place, goal, kept);
    ASSERT_TRUE(path.found()) << path.reason;
    EXPECT_LT(path.length, 1.02 * navigation.findPath(place, goal).length) << place.transpose();
    const Vec3 direction = (path.points[1] - path.points[0]).normalized();
    const auto next = navigation.tryStep(path.points[0], path.points[0] + kStep * direction, true);
    ASSERT_TRUE(next);
    place = *next;
  }
  EXPECT_LT(steps, 60);
}

TEST(KeptPath, LeadsOverSteps) {
  std::vector<NamedBox> boxes = makeHallWithWall();
  for (int i = 0; i < 4; ++i)
    boxes.push_back({"stair/" + std::to_string(i),
                     {6 + 0.3 * i, -0.2, -4},
                     {i == 3 ? 10.0 : 6.3 + 0.3 * i, 0.17 * (i + 1), 4}});
  Navigation navigation(makeBoxScene(boxes), {}, {});
  std::vector<Vec3> places{{1, 0, -2}};
  while (places.back().x() < 8) {
    const Vec3 onwards(0.13, 0, 0.05 * std::sin(9 * places.back().x()));
    places.push_back(*navigation.tryStep(places.back(), places.back() + onwards, true));
  }
  ASSERT_NEAR(places.back().y(), 0.68, 1e-3);
  const KeptJourney journey = compareWithNew(navigation, places, {9, 0.68, 1});
  EXPECT_LT(journey.maxExcess, 0.02);
  EXPECT_LT(journey.searches, 20);
}

/// An agent comes to a point of its path as the walk of the whole did. From there on it is the
/// same.
TEST(KeptPath, OverStepsIsWalkedUntilItStandsAsBefore) {
  std::vector<NamedBox> boxes{{"floor", {-6, -0.2, -4}, {6, 0, 4}},
                              {"step", {1, 0, -4}, {6, 0.2, 4}},
                              {"wall", {3, 0.2, -4}, {3.2, 2, 2}}};
  Navigation navigation(makeBoxScene(boxes), {}, {});
  const Vec3 goal(5, 0.2, 0);
  std::optional<KeptPath> kept;
  ASSERT_TRUE(navigation.findPathAgain({-2, 0, 0}, goal, kept).found());
  ASSERT_EQ(kept->stood.size(), kept->path.points.size());
  ASSERT_TRUE(kept->stood.back());
  EXPECT_NEAR(kept->stood.back()->y(), 0.2, 1e-3);
  const Vec3 searchedFrom = kept->searchedFrom;
  ASSERT_TRUE(navigation.findPathAgain({-1.9, 0, 0.1}, goal, kept).found());
  EXPECT_EQ(kept->searchedFrom, searchedFrom);
  EXPECT_EQ(kept->stood.size(), kept->path.points.size());
  // Beyond the point where it stands as before, nothing is walked again.
  std::optional<KeptPath> beyond = kept;
  ASSERT_GE(beyond->path.points.size(), 4u);
  beyond->path.points.insert(beyond->path.points.end() - 1, Vec3(2, 0.2, -3));
  beyond->stood.insert(beyond->stood.end() - 1, std::nullopt);
  beyond->excess = {100, 100};  // its length alone is no reason for a search
  navigation.findPathAgain({-1.85, 0, 0.15}, goal, beyond);
  EXPECT_EQ(beyond->searchedFrom, searchedFrom);
  // The path leads through the wall, and nothing is known of how it was walked.
  kept->path.points.insert(kept->path.points.end() - 1, Vec3(5, 0.2, -3));
  kept->path.points.insert(kept->path.points.end() - 2, Vec3(2, 0.2, -3));
  kept->stood.assign(kept->path.points.size(), std::nullopt);
  kept->excess = {100, 100};
  const NavigationPath path = navigation.findPathAgain({-1.8, 0, 0.2}, goal, kept);
  EXPECT_TRUE(isPathWalked(navigation, path));
  EXPECT_NE(kept->searchedFrom, searchedFrom);
}

/// The foot of the stair is behind the agent. The floor below its upper end is in clear sight.
TEST(KeptPath, DoesNotLeaveOutAStairToAMezzanine) {
  std::vector<NamedBox> boxes{{"floor", {-8, -0.2, -4}, {8, 0, 4}},
                              {"mezzanine", {0.8, 2.5, -4}, {8, 2.7, 4}}};
  for (int i = 0; i < 16; ++i)
    boxes.push_back({"stair/" + std::to_string(i),
                     {-4 + 0.3 * i, 0.16875 * (i + 1) - 0.1, 2.4},
                     {-3.7 + 0.3 * i, 0.16875 * (i + 1), 3.6}});
  Navigation navigation(makeBoxScene(boxes), {}, {});
  const Vec3 goal(4, 2.7, -2);
  std::optional<KeptPath> kept;
  ASSERT_TRUE(navigation.findPathAgain({0, 0, -1}, goal, kept).found());
  // The stair as one leg, from its foot to its upper end.
  std::vector<Vec3>& points = kept->path.points;
  ASSERT_GE(points.size(), 4u);
  ASSERT_LT(points[1].x(), -3.5);
  ASSERT_NEAR(points.end()[-2].y(), 2.7, 0.01);
  points.erase(points.begin() + 2, points.end() - 2);
  const NavigationPath path = navigation.findPathAgain({-0.05, 0, -0.95}, goal, kept);
  EXPECT_EQ(path.points.size(), 4u);
  EXPECT_LT(path.points[1].x(), -3.5) << "the foot of the stair";
}

TEST(KeptPath, IsSearchedAgainForAnotherGoalAndWhereABodyMoved) {
  std::vector<NamedBox> boxes = makeHallWithWall();
  boxes.push_back({"leaf", {3.01, 0.01, -0.05}, {5.99, 2, 0.05}});
  boxes.push_back({"end", {-6, 0, -0.1}, {-3, kHallHeight, 0.1}});
  Model model = makeBoxModel(boxes);
  BodySpec leaf = makeBodySpec("leaf", BodyKind::sliding, {2});
  leaf.axis = Vec3::UnitY();
  leaf.high = 2.2;
  model.bodies.push_back(leaf);
  const auto scene = std::make_shared<const Scene>(std::move(model));
  const auto closed = World(scene).snapshot(), open = makeSnapshotWithOpenDoors(scene, {});
  Navigation navigation(scene, {}, {}, open.get());
  std::optional<KeptPath> kept;
  const NavigationPath path = navigation.findPathAgain({0, 0, -2}, {0, 0, 2}, kept);
  ASSERT_TRUE(path.found()) << path.reason;
  ASSERT_TRUE(kept);
  const NavigationPath other = navigation.findPathAgain({0, 0, -2}, {1, 0, 2}, kept);
  ASSERT_TRUE(other.found());
  EXPECT_NEAR(other.points.back().x(), 1, 1e-3);
  EXPECT_EQ(kept->goal, Vec3(1, 0, 2));
  EXPECT_GT(navigation.update(*closed), 0u);
  EXPECT_FALSE(navigation.findPathAgain({0, 0, -2}, {1, 0, 2}, kept).found());
  EXPECT_FALSE(kept);
  EXPECT_EQ(navigation.update(*open), 0u) << "its meshes are kept";
  EXPECT_TRUE(navigation.findPathAgain({0, 0, -2}, {1, 0, 2}, kept).found());
}

TEST(KeptPath, OfAPlaceWithoutRoomIsNone) {
  Navigation navigation(makeBoxScene(makeHallWithWall()), {}, {});
  std::optional<KeptPath> kept;
  ASSERT_TRUE(navigation.findPathAgain({0, 0, -2}, {0, 0, 2}, kept).found());
  const NavigationPath none = navigation.findPathAgain({0, 0, 0}, {0, 0, 2}, kept);
  EXPECT_FALSE(none.found());
  EXPECT_FALSE(kept);
  EXPECT_NE(none.reason.find("at the start"), std::string::npos) << none.reason;
}

}  // namespace
}  // namespace enfilade::scene::testing
