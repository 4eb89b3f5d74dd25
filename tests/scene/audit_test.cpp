// The audit of a live world: nothing to find while the broad phase is right, everything once it is
// spoilt.
#include "scene/world/audit.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "scene/world/data/world_data.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;
using Kind = AuditFinding::Kind;

const NamedBox kWall{"wall", {3, 0, -2}, {3.2, 3, 2}};

World room(int avatars) {
  World world(boxScene({floorBox(), kWall, {"table", {-3, 0, 1}, {-2, 0.8, 2}}}));
  for (int i = 0; i < avatars; ++i) {
    EXPECT_FALSE(submit(world, {"a" + std::to_string(i), Spawn{{0.9 * i - 4, 0, -1}}, 0}));
  }
  tick(world);
  EXPECT_EQ(world.snapshot()->avatars.size(), static_cast<std::size_t>(avatars));
  return world;
}

void driveAbout(World& world, std::mt19937_64& random) {
  for (const AvatarView& avatar : world.snapshot()->avatars) {
    const auto component = [&] { return 4 * static_cast<double>(random() >> 11) * 0x1p-53 - 2; };
    const double x = component(), z = component();
    EXPECT_FALSE(submit(world, {avatar.name, Drive{{x, 0, z}}, 0}));
  }
}

/// The broad phase as if the still box `still` were `box`.
void deceive(WorldState& world, collision::StillId still, const Box& box) {
  std::vector<Box> boxes = world.scene->stillBoxes();
  boxes[still] = box;
  world.broadPhase = collision::SortAndSweep(boxes);
  std::map<collision::MoverId, std::string> movers;
  for (auto& [name, avatar] : world.avatars) {
    avatar.mover = world.broadPhase.insert(avatar.reach);
    movers[avatar.mover] = name;
  }
  world.avatarOfMover = movers;
}

TEST(Audit, FindsPairsAndNothingWrongOnAWalk) {
  World world = room(8);
  auditBroadPhase(world, 3);
  std::mt19937_64 random(11);
  std::uint64_t audits = 0, pairs = 0;
  for (int i = 0; i < 600; ++i) {
    if (i % 60 == 0) driveAbout(world, random);
    if (i == 300) submit(world, {"a3", Leave{}, 0});
    const TickReport report = tick(world);
    ASSERT_EQ(report.audit.has_value(), report.snapshot->tick % 3 == 0);
    if (!report.audit) continue;
    ++audits;
    pairs += report.audit->pairs;
    EXPECT_TRUE(report.audit->findings.empty());
    EXPECT_EQ(report.audit->movers, report.snapshot->avatars.size());
    EXPECT_EQ(report.audit->pairs, report.pairs) << "all avatars were asked about";
  }
  EXPECT_EQ(audits, 200u);
  EXPECT_GT(pairs, 8 * audits) << "each stands on the floor, and meets others";
}

TEST(Audit, IsOffUnlessAskedFor) {
  World world = room(1);
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(tick(world).audit);
  auditBroadPhase(world, 1);
  EXPECT_TRUE(tick(world).audit);
  auditBroadPhase(world, 0);
  EXPECT_FALSE(tick(world).audit);
}

TEST(Audit, AnEmptyWorldIsRight) {
  World world(boxScene({floorBox()}));
  auditBroadPhase(world, 1);
  const TickReport report = tick(world);
  ASSERT_TRUE(report.audit);
  EXPECT_EQ(report.audit->movers, 0u);
  EXPECT_TRUE(report.audit->findings.empty());
}

TEST(Audit, ChangesNoBitOfTheWorld) {
  World plain = room(5), audited = room(5);
  auditBroadPhase(audited, 1);
  std::mt19937_64 random(5), same(5);
  for (int i = 0; i < 120; ++i) {
    if (i % 40 == 0) driveAbout(plain, random), driveAbout(audited, same);
    EXPECT_EQ(tick(plain).snapshot->stateHash, tick(audited).snapshot->stateHash);
  }
}

TEST(Audit, NamesThePairWhoseStillBoxWasWithheld) {
  World world = room(1);
  deceive(world.state(), 0, {Vec3::Constant(900), Vec3::Constant(901)});  // no floor
  auditBroadPhase(world, 1);
  const TickReport report = tick(world);
  ASSERT_TRUE(report.audit);
  ASSERT_EQ(report.audit->findings.size(), 1u);
  const AuditFinding& finding = report.audit->findings[0];
  EXPECT_EQ(finding.kind, Kind::missed);
  EXPECT_EQ(nameOf(world, finding.mover), "a0");
  EXPECT_EQ(nameOf(world, finding.other), "floor");
  EXPECT_TRUE(overlaps(finding.moverBox, finding.otherBox));
  EXPECT_EQ(finding.otherBox.max.y(), 0);
}

TEST(Audit, NamesThePairThatIsHeldWithoutAnOverlap) {
  World world = room(1);
  deceive(world.state(), 1, {Vec3::Constant(-9), Vec3::Constant(9)});  // a wall everywhere
  auditBroadPhase(world, 1);
  const TickReport report = tick(world);
  ASSERT_TRUE(report.audit);
  ASSERT_EQ(report.audit->findings.size(), 1u);
  EXPECT_EQ(report.audit->findings[0].kind, Kind::extra);
  EXPECT_EQ(nameOf(world, report.audit->findings[0].other), "wall");
}

TEST(Audit, AMoverMovedBehindTheBroadPhasesBackIsFound) {
  World world = room(2);
  WorldState& state = world.state();
  EXPECT_TRUE(auditTick(state).findings.empty());
  Avatar& avatar = state.avatars.at("a1");
  const Vec3 away = Vec3(3, 1, 0) - avatar.feet;  // into the wall, off the floor and from a0
  avatar.reach = {avatar.reach.min + away, avatar.reach.max + away};
  std::set<std::pair<Kind, std::string>> found;
  for (const AuditFinding& finding : auditTick(state).findings) {
    const EntityId other = finding.mover == avatar.id ? finding.other : finding.mover;
    found.insert({finding.kind, nameOf(world, other)});
  }
  EXPECT_TRUE(found.contains({Kind::missed, "wall"}));
  EXPECT_TRUE(found.contains({Kind::extra, "floor"}));
}

TEST(Audit, WhereItWouldTakeTooLongTheAvatarsTakeTurns) {
  constexpr int kAvatars = 7;
  World world = room(kAvatars);
  WorldState& state = world.state();
  const std::size_t testsForOne = state.scene->stillBoxes().size() + kAvatars;
  for (auto& [name, avatar] : state.avatars) {  // in the air, as the broad phase does not know
    avatar.reach.min += Vec3(0, 500, 0);
    avatar.reach.max += Vec3(0, 500, 0);
  }
  std::map<EntityId, int> found;  // by how many audits
  for (int i = 0; i < kAvatars; ++i) {
    const TickAudit audit = auditTick(state, 3 * (testsForOne + 1));
    EXPECT_EQ(audit.movers, 3u);
    for (const AuditFinding& finding : audit.findings) found[finding.mover] += finding.other == 1;
  }
  ASSERT_EQ(found.size(), static_cast<std::size_t>(kAvatars));
  for (const auto& [id, times] : found) EXPECT_EQ(times, 3) << nameOf(world, id);
  EXPECT_EQ(auditTick(state, 0).movers, 1u) << "one at least";
}

}  // namespace
}  // namespace enfilade::scene
