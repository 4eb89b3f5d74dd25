// Tests of parts of the server that need no socket.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "server/base/host_port.hpp"
#include "server/messages/outgoing_queue.hpp"
#include "server/messages/tick_statistics.hpp"
#include "server/messages/world_messages.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::server::testing {
namespace {

Buffer makeBytes(std::size_t count) {
  return std::make_shared<const std::vector<std::uint8_t>>(count);
}

TEST(OutgoingQueues, ShareABudgetAndGiveItBack) {
  const auto message = [](std::size_t bytes) {
    return std::make_shared<const std::vector<std::uint8_t>>(bytes);
  };
  OutgoingLimits limits{1000, 2};
  limits.budget = std::make_shared<OutgoingBudget>(1500);
  const Buffer tooSlow = message(1);
  OutgoingQueue second(limits, tooSlow, [] {});
  {
    OutgoingQueue first(limits, tooSlow, [] {});
    first.push(message(900));
    second.push(message(500));
    EXPECT_EQ(limits.budget->bytes, 1400u);
    EXPECT_FALSE(second.overflowed());
    second.push(message(200));
    EXPECT_TRUE(second.overflowed()) << "1600 bytes of both";
    EXPECT_FALSE(first.overflowed());
    EXPECT_EQ(limits.budget->bytes, 900u);
    first.push(message(100));
    EXPECT_EQ(first.pop().message.size(), 900u);
    EXPECT_EQ(limits.budget->bytes, 100u);
  }
  EXPECT_EQ(limits.budget->bytes, 0u);
  EXPECT_EQ(second.pop().message.size(), 1u);
}

TEST(OutgoingQueue, KeepsRepliesInOrderAndOnlyTheLatestState) {
  int woken = 0;
  OutgoingQueue queue({1000, 2}, makeBytes(1), [&] { ++woken; });
  queue.push(makeBytes(10));
  queue.pushLatest(makeBytes(20));
  EXPECT_TRUE(queue.dropLatest());
  EXPECT_FALSE(queue.dropLatest());
  queue.pushLatest(makeBytes(21));
  queue.push(makeBytes(11));
  EXPECT_EQ(queue.pop().message.size(), 10u);
  EXPECT_EQ(queue.pop().message.size(), 21u);
  EXPECT_EQ(queue.pop().message.size(), 11u);
  EXPECT_FALSE(queue.pop().message);
  EXPECT_EQ(woken, 4);
}

TEST(OutgoingQueue, AboveItsBoundOnlyTheFinalMessageIsLeft) {
  OutgoingQueue queue({100, 2}, makeBytes(7), [] {});
  queue.push({makeBytes(10), makeBytes(50)});
  queue.push(makeBytes(40));
  EXPECT_FALSE(queue.overflowed());
  EXPECT_EQ(queue.pop().message.size(), 60u);
  queue.push(makeBytes(61));
  EXPECT_TRUE(queue.overflowed());
  const OutgoingQueue::Next next = queue.pop();
  EXPECT_EQ(next.message.size(), 7u);
  EXPECT_TRUE(next.last);
  queue.push(makeBytes(1));
  EXPECT_FALSE(queue.pop().message) << "nothing is said after the last words";
}

TEST(OutgoingQueue, CountsBothPiecesOfPictures) {
  OutgoingQueue queue({100, 9, 150}, makeBytes(7), [] {});
  queue.pushFrame({makeBytes(1), makeBytes(100)});
  EXPECT_FALSE(queue.overflowed());
  queue.pushFrame({makeBytes(1), makeBytes(100)});
  EXPECT_TRUE(queue.overflowed());
}

TEST(OutgoingQueue, CountsPicturesAndNotTheirBytes) {
  OutgoingQueue queue({100, 2}, makeBytes(7), [] {});
  queue.pushFrame(makeBytes(5000));
  queue.pushFrame(makeBytes(5000));
  EXPECT_FALSE(queue.overflowed());
  queue.pop();
  queue.pushFrame(makeBytes(5000));
  EXPECT_FALSE(queue.overflowed());
  queue.pushFrame(makeBytes(5000));
  EXPECT_TRUE(queue.overflowed());
}

TEST(OutgoingQueue, FinishingSendsPendingMessagesFirst) {
  OutgoingQueue queue({100, 2}, makeBytes(7), [] {});
  queue.push(makeBytes(1));
  queue.finish(makeBytes(2));
  queue.finish(makeBytes(3));
  EXPECT_FALSE(queue.pop().last);
  const OutgoingQueue::Next next = queue.pop();
  EXPECT_EQ(next.message.size(), 2u);
  EXPECT_TRUE(next.last);
  EXPECT_FALSE(queue.pop().message);
}

TEST(DurationHistogram, AgreesWithSortingWithinABucket) {
  std::mt19937_64 random(7);
  std::lognormal_distribution<double> durations(-10, 1.5);
  DurationHistogram histogram;
  std::vector<double> all;
  for (int i = 0; i < 5000; ++i) {
    all.push_back(durations(random));
    histogram.record(all.back());
  }
  std::sort(all.begin(), all.end());
  for (const double fraction : {0.01, 0.5, 0.9, 0.99}) {
    const double exact = all[static_cast<std::size_t>(fraction * 4999)];
    EXPECT_NEAR(histogram.quantile(fraction) / exact, 1, 0.011) << fraction;
  }
  EXPECT_EQ(histogram.max(), all.back());
  EXPECT_EQ(DurationHistogram{}.quantile(0.5), 0);
}

/// An upright sheet of 1,800 triangles at x = 4: y in 0..3, z in -5..5.
scene::Mesh makeDenseSheet() {
  constexpr std::uint32_t kSteps = 30;
  scene::Mesh sheet;
  for (std::uint32_t i = 0; i <= kSteps; ++i)
    for (std::uint32_t k = 0; k <= kSteps; ++k)
      sheet.positions.push_back(
          scene::Vec3(4, 3.0 * i / kSteps, 10.0 * k / kSteps - 5).cast<float>());
  constexpr std::uint32_t kRow = kSteps + 1;
  for (std::uint32_t i = 0; i < kSteps; ++i)
    for (std::uint32_t k = 0; k < kSteps; ++k) {
      const std::uint32_t at = i * kRow + k;
      sheet.indices.insert(sheet.indices.end(),
                           {at, at + 1, at + kRow, at + 1, at + kRow + 1, at + kRow});
    }
  return sheet;
}

/// The sheet on a floor. High above them, a body of four bars turns next to a post.
scene::Model makeDenseRoomWithATurningBody() {
  using scene::Vec3;
  std::vector<scene::testing::NamedBox> boxes;
  for (int i = 0; i < 4; ++i)
    boxes.push_back(
        {"bar" + std::to_string(i), Vec3(0.3 * i, 10, 0), Vec3(0.3 * i + 0.2, 10.1, 1)});
  boxes.push_back({"post", Vec3(0, 9.5, 1.06), Vec3(0.2, 10.5, 1.3)});
  boxes.push_back(scene::testing::makeFloorBox());
  scene::Model model = scene::testing::makeBoxModel(boxes);
  model.meshes.push_back(makeDenseSheet());
  model.objects.push_back({"sheet",
                           "",
                           {static_cast<std::uint32_t>(model.meshes.size() - 1)},
                           Eigen::Affine3d::Identity()});
  scene::BodySpec shuttle;
  shuttle.name = "shuttle";
  shuttle.kind = scene::BodyKind::path;
  shuttle.objects = {0, 1, 2, 3};
  shuttle.anchor = Vec3(0.5, 10, 0.5);
  shuttle.keys = {{0, Vec3::Zero(), 0}, {2, Vec3(0, 0, 0.1), 1}};
  model.bodies.push_back(shuttle);
  return model;
}

constexpr std::size_t kWorkTicks = 90;

/// Reports of the room's ticks. Three avatars come one after the other, against the order of their
/// names; after half a second all walk, "bob" against the sheet.
std::vector<scene::TickReport> runDenseRoom() {
  scene::World world(std::make_shared<const scene::Scene>(makeDenseRoomWithATurningBody()));
  const std::vector<std::pair<std::string, scene::Vec3>> avatars{
      {"zoe", {-6, 0.1, -3}}, {"bob", {3.5, 0.1, 0}}, {"ann", {-6, 0.1, 3}}};
  const auto order = [&](const std::string& name, scene::Order given) {
    const auto why = scene::submitAvatarCommand(world, {name, std::move(given), 0});
    EXPECT_FALSE(why) << *why;
  };
  std::vector<scene::TickReport> reports;
  for (std::size_t tick = 0; tick < kWorkTicks; ++tick) {
    if (tick < avatars.size()) {
      scene::Spawn spawned;
      spawned.position = avatars[tick].second;
      order(avatars[tick].first, spawned);
    }
    if (tick == 30)
      for (const auto& [name, position] : avatars) order(name, scene::Drive{{1.5, 0, 0.3}});
    reports.push_back(scene::tickWorld(world));
  }
  return reports;
}

v1::Metrics makeMetrics(const std::vector<scene::TickReport>& reports) {
  TickStatistics statistics;
  for (const scene::TickReport& report : reports) statistics.addTick(report);
  return statistics.makeMetrics();
}

/// Compares with the work that the report of the same tick has of this avatar.
void expectReportedWork(const v1::AvatarWork& work, const scene::TickReport& report) {
  EXPECT_EQ(work.tick(), report.snapshot->tick);
  const auto reported =
      std::ranges::find(report.avatarWork, scene::EntityId{work.id()}, &scene::AvatarWork::id);
  ASSERT_NE(reported, report.avatarWork.end()) << work.id();
  EXPECT_EQ(work.narrow_queries(), reported->narrowQueries) << work.id();
  EXPECT_EQ(work.parts_looked_at(), reported->partsLookedAt) << work.id();
  EXPECT_EQ(vectorFromProto(work.position()), reported->footPosition) << work.id();
}

TEST(TickStatistics, SumTheWorkOfAllTicks) {
  const std::vector<scene::TickReport> reports = runDenseRoom();
  std::uint64_t queries = 0, vertices = 0, boxes = 0, parts = 0;
  for (const scene::TickReport& report : reports) {
    queries += report.narrowQueries;
    vertices += report.verticesLookedAt;
    boxes += report.partBoxesMade;
    parts += report.partsLookedAt;
  }
  EXPECT_GT(reports.back().verticesLookedAt, 0u) << "the body still turns";
  EXPECT_GE(boxes, 80u) << "of the bars next to the post";
  const v1::Metrics metrics = makeMetrics(reports);
  EXPECT_EQ(metrics.narrow_queries(), queries);
  EXPECT_EQ(metrics.vertices_looked_at(), vertices);
  EXPECT_EQ(metrics.part_boxes_made(), boxes);
  EXPECT_EQ(metrics.parts_looked_at(), parts);
}

TEST(TickStatistics, ListTheWorkOfTheAvatarsInTheLastTickByAscendingIds) {
  const std::vector<scene::TickReport> reports = runDenseRoom();
  const scene::TickReport& last = reports.back();
  ASSERT_FALSE(std::ranges::is_sorted(last.avatarWork, {}, &scene::AvatarWork::id))
      << "the order of the report is that of the names";
  const v1::Metrics metrics = makeMetrics(reports);
  ASSERT_EQ(metrics.avatar_work_size(), 3);
  std::uint64_t parts = 0;
  for (int i = 0; i < 3; ++i) {
    const v1::AvatarWork& work = metrics.avatar_work(i);
    EXPECT_EQ(work.id(), last.snapshot->avatars.at(static_cast<std::size_t>(i)).id);
    EXPECT_GT(work.narrow_queries(), 0u) << work.id();
    expectReportedWork(work, last);
    parts += work.parts_looked_at();
  }
  EXPECT_GT(parts, 0u);
  EXPECT_EQ(parts, last.partsLookedAt) << "the total of the tick";
}

TEST(TickStatistics, TheCostliestAvatarIsTheOneWithTheMostQueriesInATick) {
  const std::vector<scene::TickReport> reports = runDenseRoom();
  std::uint32_t maxQueries = 0;
  for (const scene::TickReport& report : reports)
    for (const scene::AvatarWork& work : report.avatarWork)
      maxQueries = std::max(maxQueries, work.narrowQueries);
  const v1::AvatarWork costliest = makeMetrics(reports).costliest_avatar();
  EXPECT_EQ(costliest.narrow_queries(), maxQueries);
  ASSERT_TRUE(costliest.tick() >= 1 && costliest.tick() <= kWorkTicks) << costliest.tick();
  expectReportedWork(costliest, reports[costliest.tick() - 1]);
  const auto& avatars = reports.back().snapshot->avatars;
  const auto bob = std::ranges::find(avatars, std::string("bob"), &scene::AvatarSnapshot::name);
  ASSERT_NE(bob, avatars.end());
  EXPECT_EQ(costliest.id(), bob->id) << "it pushes against the sheet";
}

/// A tick with the work of these avatars alone.
scene::TickReport makeReportOfWork(std::uint64_t tick, std::vector<scene::AvatarWork> avatars) {
  const auto snapshot = std::make_shared<scene::Snapshot>();
  snapshot->tick = tick;
  scene::TickReport report;
  report.snapshot = snapshot;
  for (const scene::AvatarWork& work : avatars) report.partsLookedAt += work.partsLookedAt;
  report.avatarWork = std::move(avatars);
  return report;
}

TEST(TickStatistics, ListAtMostAThousandAvatarsAndCountThoseBeyond) {
  constexpr scene::EntityId kAvatars = 1200, kCostliest = 1150;
  std::vector<scene::AvatarWork> avatars;
  for (scene::EntityId id = 1; id <= kAvatars; ++id)
    avatars.push_back({id, 10 + id % 7, id, scene::Vec3(id, 0, 0)});
  std::ranges::shuffle(avatars, std::mt19937_64(8));
  const scene::TickReport slow = makeReportOfWork(2, avatars);
  std::ranges::find(avatars, kCostliest, &scene::AvatarWork::id)->narrowQueries = 5000;
  TickStatistics statistics;
  EXPECT_FALSE(statistics.makeMetrics().has_costliest_avatar());
  statistics.addTick(makeReportOfWork(1, avatars));
  statistics.addTick(slow);
  const v1::Metrics metrics = statistics.makeMetrics();
  ASSERT_EQ(metrics.avatar_work_size(), 1000);
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(metrics.avatar_work(i).id(), static_cast<scene::EntityId>(i + 1));
    expectReportedWork(metrics.avatar_work(i), slow);
  }
  EXPECT_EQ(metrics.parts_looked_at(), 2u * (kAvatars * (kAvatars + 1) / 2));
  EXPECT_EQ(metrics.costliest_avatar().id(), kCostliest) << "of an earlier tick";
  EXPECT_EQ(metrics.costliest_avatar().tick(), 1u);
  EXPECT_EQ(metrics.costliest_avatar().narrow_queries(), 5000u);
  statistics.addTick(makeReportOfWork(3, {}));
  EXPECT_EQ(statistics.makeMetrics().avatar_work_size(), 0) << "of the last tick alone";
  EXPECT_EQ(statistics.makeMetrics().costliest_avatar().id(), kCostliest);
}

TEST(CommandLine, EndpointsAreHostAndPort) {
  EXPECT_EQ(parseHostPort("127.0.0.1:7878")->port, 7878);
  EXPECT_EQ(parseHostPort("[::1]:0")->host, "::1");
  EXPECT_EQ(parseHostPort("localhost:65535")->host, "localhost");
  for (const char* bad : {"", ":", "host", "host:", ":1", "host:x", "host:65536", "host:-1", "::1",
                          "host:1 ", "[]:1", "host:1:2"}) {
    EXPECT_FALSE(parseHostPort(bad)) << bad;
  }
}

}  // namespace
}  // namespace enfilade::server::testing
