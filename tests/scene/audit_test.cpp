// Tests of the audit of a running world: no findings while the broad phase is right, every contact
// once its boxes are falsified.
#include "scene/world/audit.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "scene/world/data/world_data.hpp"
#include "scene/world/world.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using Finding = AuditFinding::Kind;

const NamedBox kWall{"wall", {3, 0, -2}, {3.2, 3, 2}};

World enterAvatars(World world, const std::vector<Vec3>& places) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_FALSE(submitAvatarCommand(world, {"a" + std::to_string(i), Spawn{places[i]}, 0}));
  }
  tickWorld(world);
  EXPECT_EQ(world.snapshot()->avatars.size(), places.size());
  return world;
}

World makeRoomWithAvatars(int avatars) {
  std::vector<Vec3> places;
  for (int i = 0; i < avatars; ++i) places.emplace_back(0.9 * i - 4, 0, -1);
  return enterAvatars(
      World(makeBoxScene({makeFloorBox(), kWall, {"table", {-3, 0, 1}, {-2, 0.8, 2}}})), places);
}

void driveAbout(World& world, std::mt19937_64& random) {
  for (const AvatarSnapshot& avatar : world.snapshot()->avatars) {
    const auto component = [&] { return 4 * static_cast<double>(random() >> 11) * 0x1p-53 - 2; };
    const double x = component(), z = component();
    EXPECT_FALSE(submitAvatarCommand(world, {avatar.name, Drive{{x, 0, z}}, 0}));
  }
}

/// Replaces a static box in the broad phase, so that it no longer matches the object.
void deceive(WorldData& world, collision::StaticId still, const Aabb& box) {
  std::vector<Aabb> boxes = world.scene->staticBoxes();
  boxes[still] = box;
  world.broadPhase = collision::SortAndSweep(boxes);
  for (Avatar& avatar : world.avatars)
    world.setAvatarProxy(avatar, world.broadPhase.insert(avatar.motionBounds));
}

TEST(Audit, FindsPairsAndNothingWrongOnAWalk) {
  World world = makeRoomWithAvatars(8);
  setAuditInterval(world, 3);
  std::mt19937_64 random(11);
  std::uint64_t audits = 0, pairs = 0;
  for (int i = 0; i < 600; ++i) {
    if (i % 60 == 0) driveAbout(world, random);
    if (i == 300) submitAvatarCommand(world, {"a3", Leave{}, 0});
    const TickReport report = tickWorld(world);
    ASSERT_EQ(report.audit.has_value(), report.snapshot->tick % 3 == 0);
    if (!report.audit) continue;
    ++audits;
    pairs += report.audit->pairs;
    EXPECT_TRUE(report.audit->findings.empty());
    EXPECT_EQ(report.audit->proxies, report.snapshot->avatars.size());
    EXPECT_EQ(report.audit->pairs, report.pairs) << "all avatars were audited";
  }
  EXPECT_EQ(audits, 200u);
  EXPECT_GT(pairs, 8 * audits) << "each stands on the floor, and touches others";
}

/// 400 avatars in rows of 20 on a wide floor.
World makeCrowd() {
  std::vector<Vec3> places;
  for (int i = 0; i < 400; ++i) places.emplace_back(0.9 * (i % 20) - 9, 0, 0.9 * (i / 20) - 9);
  return enterAvatars(World(makeBoxScene({{"floor", {-20, -1, -20}, {20, 0, 20}}})), places);
}

TEST(Audit, FindsNothingWrongInBatchesAndInLists) {
  World world = makeCrowd();
  setAuditInterval(world, 1);
  std::mt19937_64 random(3);
  int inBatches = 0, inLists = 0;
  std::uint64_t pairs = 0;
  for (int i = 0; i < 100; ++i) {
    if (i % 20 == 0) driveAbout(world, random);
    const TickReport report = tickWorld(world);
    (world.data().broadPhase.counters().batched > 0 ? inBatches : inLists) += 1;
    ASSERT_TRUE(report.audit);
    EXPECT_EQ(report.audit->proxies, 400u) << "none waits for its turn";
    EXPECT_EQ(report.audit->pairs, report.pairs);
    EXPECT_TRUE(report.audit->findings.empty());
    pairs += report.audit->pairs;
  }
  EXPECT_GT(inBatches, 0);
  EXPECT_GT(inLists, 0);
  EXPECT_GT(pairs, 100u * 400u) << "all stand on the floor, and some touch others";
}

TEST(Audit, IsOffByDefault) {
  World world = makeRoomWithAvatars(1);
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(tickWorld(world).audit);
  setAuditInterval(world, 1);
  EXPECT_TRUE(tickWorld(world).audit);
  setAuditInterval(world, 0);
  EXPECT_FALSE(tickWorld(world).audit);
}

TEST(Audit, AnEmptyWorldIsRight) {
  World world(makeBoxScene({makeFloorBox()}));
  setAuditInterval(world, 1);
  const TickReport report = tickWorld(world);
  ASSERT_TRUE(report.audit);
  EXPECT_EQ(report.audit->proxies, 0u);
  EXPECT_TRUE(report.audit->findings.empty());
}

TEST(Audit, ChangesNoBitOfTheWorld) {
  World plain = makeRoomWithAvatars(5), audited = makeRoomWithAvatars(5);
  setAuditInterval(audited, 1);
  std::mt19937_64 random(5), same(5);
  for (int i = 0; i < 120; ++i) {
    if (i % 40 == 0) driveAbout(plain, random), driveAbout(audited, same);
    EXPECT_EQ(tickWorld(plain).snapshot->stateHash, tickWorld(audited).snapshot->stateHash);
  }
}

TEST(Audit, NamesThePairOfAWithheldStaticBox) {
  World world = makeRoomWithAvatars(1);
  deceive(world.data(), 0, {Vec3::Constant(900), Vec3::Constant(901)});  // no floor
  setAuditInterval(world, 1);
  const TickReport report = tickWorld(world);
  ASSERT_TRUE(report.audit);
  ASSERT_EQ(report.audit->findings.size(), 1u);
  const AuditFinding& finding = report.audit->findings[0];
  EXPECT_EQ(finding.kind, Finding::missed);
  EXPECT_EQ(findEntityName(world, finding.entity), "a0");
  EXPECT_EQ(findEntityName(world, finding.other), "floor");
  EXPECT_TRUE(overlaps(finding.entityBox, finding.otherBox));
  EXPECT_EQ(finding.otherBox.max.y(), 0);
}

TEST(Audit, NamesThePairThatIsHeldWithoutAnOverlap) {
  World world = makeRoomWithAvatars(1);
  deceive(world.data(), 1, {Vec3::Constant(-9), Vec3::Constant(9)});  // a wall everywhere
  setAuditInterval(world, 1);
  const TickReport report = tickWorld(world);
  ASSERT_TRUE(report.audit);
  ASSERT_EQ(report.audit->findings.size(), 1u);
  EXPECT_EQ(report.audit->findings[0].kind, Finding::extra);
  EXPECT_EQ(findEntityName(world, report.audit->findings[0].other), "wall");
}

TEST(Audit, AProxyMovedWithoutTheBroadPhaseIsFound) {
  World world = makeRoomWithAvatars(2);
  WorldData& state = world.data();
  EXPECT_TRUE(auditTick(state).findings.empty());
  Avatar& avatar = state.avatars[1];
  const Vec3 away =
      Vec3(3, 1, 0) - avatar.footPosition;  // into the wall, off the floor, away from a0
  avatar.motionBounds = {avatar.motionBounds.min + away, avatar.motionBounds.max + away};
  std::set<std::pair<Finding, std::string>> found;
  for (const AuditFinding& finding : auditTick(state).findings) {
    const EntityId other = finding.entity == avatar.id ? finding.other : finding.entity;
    found.insert({finding.kind, findEntityName(world, other)});
  }
  EXPECT_TRUE(found.contains({Finding::missed, "wall"}));
  EXPECT_TRUE(found.contains({Finding::extra, "floor"}));
}

TEST(Audit, WhereItWouldTakeTooLongTheAvatarsTakeTurns) {
  constexpr int kAvatars = 7;
  World world = makeRoomWithAvatars(kAvatars);
  WorldData& state = world.data();
  const std::size_t testsForOne = state.scene->staticBoxes().size() + kAvatars;
  for (Avatar& avatar : state.avatars) {  // moves the avatar into the air without updating
                                          // the broad phase
    avatar.motionBounds.min += Vec3(0, 500, 0);
    avatar.motionBounds.max += Vec3(0, 500, 0);
  }
  std::map<EntityId, int> found;  // number of audits until the finding
  for (int i = 0; i < kAvatars; ++i) {
    const TickAudit audit = auditTick(state, 3 * (testsForOne + 1));
    EXPECT_EQ(audit.proxies, 3u);
    for (const AuditFinding& finding : audit.findings) found[finding.entity] += finding.other == 1;
  }
  ASSERT_EQ(found.size(), static_cast<std::size_t>(kAvatars));
  for (const auto& [id, times] : found) EXPECT_EQ(times, 3) << findEntityName(world, id);
  EXPECT_EQ(auditTick(state, 0).proxies, 1u) << "one at least";
}

}  // namespace
}  // namespace enfilade::scene
