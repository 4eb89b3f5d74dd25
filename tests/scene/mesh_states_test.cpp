// Meshes for several poses of bodies: worlds whose doors stand differently take turns.
#include "scene/navigation/mesh_states.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "scene/navigation/navigation.hpp"
#include "tests/scene/body_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

/// Two rooms with a gate between them, and an island behind a kerb that no agent climbs.
std::shared_ptr<const Scene> makeGatedRooms() {
  Model model = makeBoxModel({{"floor", {-4, -0.2, -3}, {4, 0, 3}},
                              {"left wall", {-0.1, 0, -3}, {0.1, 2.5, -0.6}},
                              {"right wall", {-0.1, 0, 0.6}, {0.1, 2.5, 3}},
                              {"gate", {-0.02, 0.01, -0.59}, {0.02, 2, 0.59}},
                              {"platform", {-4, 0, 2}, {-2, 1, 3}}});
  BodySpec gate = makeBodySpec("gate", BodyKind::lift, {3});
  gate.stops = {-2.2, 0};
  gate.low = -2.2;
  model.bodies.push_back(gate);
  return std::make_shared<const Scene>(std::move(model));
}

/// Of a world in which the gate is so much below its closed pose, metres.
Snapshot makeSnapshotWithGate(const std::shared_ptr<const Scene>& scene, double below) {
  Snapshot snapshot = *World(scene).snapshot();
  auto bodies = std::make_shared<std::vector<BodySnapshot>>(*snapshot.bodies);
  bodies->front().pose.translation.y() -= below;
  snapshot.bodies = bodies;
  return snapshot;
}

TEST(MeshStates, OfPosesThatComeAgainAreNotBuiltAgain) {
  const auto scene = makeGatedRooms();
  const Snapshot closed = makeSnapshotWithGate(scene, 0), open = makeSnapshotWithGate(scene, 2.2);
  Navigation navigation(scene, {}, {}, &closed);
  const Vec3 from(-2, 0, 0), to(2, 0, 0);
  const std::uint64_t first = navigation.stateNumber();
  EXPECT_FALSE(navigation.findPath(from, to).found());
  EXPECT_GT(navigation.update(open), 0u);
  const std::uint64_t second = navigation.stateNumber();
  EXPECT_NE(first, second);
  const NavigationPath path = navigation.findPath(from, to);
  EXPECT_TRUE(path.found());
  for (int turn = 0; turn < 3; ++turn) {
    EXPECT_EQ(navigation.update(closed), 0u);
    EXPECT_EQ(navigation.stateNumber(), first);
    const NavigationPath none = navigation.findPath(from, to);
    ASSERT_TRUE(none.obstruction);
    EXPECT_EQ(navigation.findEntityName(none.obstruction->entity), "gate") << "in the walker's way";
    EXPECT_EQ(navigation.update(open), 0u);
    EXPECT_EQ(navigation.stateNumber(), second);
    EXPECT_EQ(navigation.findPath(from, to).points, path.points);
  }
}

TEST(MeshStates, AreThoseOfANavigationThatBeginsThere) {
  const auto scene = makeGatedRooms();
  const Snapshot closed = makeSnapshotWithGate(scene, 0);
  Navigation navigation(scene, {}, {}, &closed);
  int found = 0, refused = 0;
  for (const double below : {2.2, 0.5, 0.0, 1.0, 2.2}) {
    const Snapshot snapshot = makeSnapshotWithGate(scene, below);
    Navigation fresh(scene, {}, {}, &snapshot);
    navigation.update(snapshot);
    EXPECT_EQ(navigation.report().islandAreas, fresh.report().islandAreas) << below;
    EXPECT_EQ(navigation.collectTriangles(std::nullopt), fresh.collectTriangles(std::nullopt));
    for (const Vec3& goal : {Vec3(2, 0, 1), Vec3(-3, 1, 2.5), Vec3(-3, 0, -2)}) {
      const NavigationPath path = navigation.findPath({-2, 0, 0}, goal),
                           other = fresh.findPath({-2, 0, 0}, goal);
      EXPECT_EQ(path.points, other.points) << below << " to " << goal.transpose();
      EXPECT_EQ(path.reason, other.reason) << below << " to " << goal.transpose();
      ++(path.found() ? found : refused);
    }
    EXPECT_EQ(navigation.save(), fresh.save()) << below;
  }
  EXPECT_EQ(found, 7) << "past the open gate, and in the room";
  EXPECT_EQ(refused, 8) << "past the closed gate, and onto the platform";
}

TEST(MeshStates, LeaveThePathsOfOtherWorldsKept) {
  const auto scene = makeGatedRooms();
  const Snapshot open = makeSnapshotWithGate(scene, 2.2);
  Navigation navigation(scene, {}, {}, &open);
  std::optional<KeptPath> kept;
  const Vec3 goal(3, 0, 2);
  ASSERT_TRUE(navigation.findPathAgain({-3, 0, 0}, goal, kept).found());
  const Vec3 searchedFrom = kept->searchedFrom;
  navigation.update(makeSnapshotWithGate(scene, 0));  // of another world
  navigation.update(open);
  EXPECT_TRUE(navigation.findPathAgain({-2.5, 0, 0}, goal, kept).found());
  EXPECT_EQ(kept->searchedFrom, searchedFrom);
  navigation.update(makeSnapshotWithGate(scene, 2.1));
  EXPECT_TRUE(navigation.findPathAgain({-2, 0, 0}, goal, kept).found());
  EXPECT_NE(kept->searchedFrom, searchedFrom) << "the gate has moved";
}

TEST(MeshStates, ThatWereLongNotUsedAreForgotten) {
  const auto scene = makeGatedRooms();
  const Snapshot closed = makeSnapshotWithGate(scene, 0), open = makeSnapshotWithGate(scene, 2.2);
  Navigation navigation(scene, {}, {}, &closed);
  const std::size_t bytes = navigation.report().bytes;
  navigation.update(open);
  for (int i = 1; i <= 70; ++i) {
    EXPECT_GT(navigation.update(makeSnapshotWithGate(scene, 0.01 * i)), 0u);
    EXPECT_EQ(navigation.update(open), 0u) << "it is used";
  }
  EXPECT_NEAR(static_cast<double>(navigation.report().bytes) / static_cast<double>(bytes), 64, 8);
  EXPECT_GT(navigation.update(closed), 0u) << "it is the oldest";
}

TEST(MeshStates, AreAsBeforeIfABuildIsAbandoned) {
  const auto scene = makeGatedRooms();
  const Snapshot closed = makeSnapshotWithGate(scene, 0), open = makeSnapshotWithGate(scene, 2.2);
  Navigation navigation(scene, {}, {}, &closed);
  const std::uint64_t number = navigation.stateNumber();
  const auto abandon = [](double share) {
    if (share > 0.9) throw std::runtime_error("abandoned");
  };
  EXPECT_THROW(navigation.update(open, 2, abandon), std::runtime_error);
  EXPECT_EQ(navigation.stateNumber(), number);
  const NavigationPath none = navigation.findPath({-2, 0, 0}, {2, 0, 0});
  ASSERT_TRUE(none.obstruction) << "the gate stands where it stood";
  EXPECT_EQ(navigation.findEntityName(none.obstruction->entity), "gate");
  EXPECT_GT(navigation.update(open), 0u);
  EXPECT_TRUE(navigation.findPath({-2, 0, 0}, {2, 0, 0}).found());
}

TEST(MeshStates, ShareTheUnobstructedMesh) {
  const auto scene = makeGatedRooms();
  const Snapshot closed = makeSnapshotWithGate(scene, 0);
  Navigation navigation(scene, {}, {}, &closed);
  int reports = 0;
  const auto find = [&] {
    reports = 0;
    return navigation.findPath({-2, 0, 0}, {-3, 1, 2.5}, {}, [&](double) { ++reports; }).reason;
  };
  const std::string reason = find();
  EXPECT_GT(reports, 0);
  EXPECT_EQ(reason, "platform is in the way: a step of 1.000 m, climbs 0.300");
  navigation.update(makeSnapshotWithGate(scene, 1));
  EXPECT_EQ(find(), reason);
  EXPECT_EQ(reports, 0);
}

}  // namespace
}  // namespace enfilade::scene::testing
