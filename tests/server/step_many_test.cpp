// StepMany: requests to several worlds over one connection.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <thread>

#include "tests/server/eventually.hpp"
#include "tests/server/served_room.hpp"
#include "tests/support/sanitized.hpp"

namespace enfilade::server::testing {
namespace {

v1::ClientMessage makeDriveRequest(double x) {
  v1::ClientMessage message;
  message.mutable_command()->set_avatar("ann");
  message.mutable_command()->mutable_drive()->mutable_velocity()->set_x(x);
  return message;
}

class StepMany : public ServedRoom {
 protected:
  void SetUp() override {
    ServerLimits limits;
    limits.closeTimeout = std::chrono::milliseconds(100);
    serve(limits);
  }
  static void create(protocol::Client& by, const std::string& name) {
    v1::ClientMessage message;
    message.mutable_create_world()->set_name(name);
    message.mutable_create_world()->set_drop_when_empty(true);
    by.request(std::move(message));
  }
  static std::size_t countWorlds(protocol::Client& by) {
    v1::ClientMessage message;
    message.mutable_list_worlds();
    return static_cast<std::size_t>(by.request(std::move(message)).worlds().worlds_size());
  }
  static v1::StepManyReply request(protocol::Client& by, const v1::StepMany& many,
                                   std::vector<std::uint8_t>* attachment = nullptr) {
    v1::ClientMessage message;
    *message.mutable_step_many() = many;
    return by.request(std::move(message), attachment).step_many();
  }
  static v1::ClientMessage makeSpawnRequest(double z) {
    v1::ClientMessage message;
    message.mutable_command()->set_avatar("ann");
    v1::Spawn& spawn = *message.mutable_command()->mutable_spawn();
    spawn.mutable_at()->set_z(z);
    return message;
  }
  static v1::ClientMessage makeStepRequest(std::uint32_t ticks) {
    v1::ClientMessage message;
    message.mutable_step()->set_ticks(ticks);
    message.mutable_step()->set_avatars(true);
    return message;
  }
  static v1::StepMany makeStepMany(int worlds, const std::vector<v1::ClientMessage>& requests) {
    v1::StepMany many;
    for (int i = 0; i < worlds; ++i) {
      v1::StepMany::World& world = *many.add_worlds();
      world.set_world("w" + std::to_string(i));
      for (const v1::ClientMessage& one : requests) *world.add_requests() = one;
    }
    return many;
  }
};

TEST_F(StepMany, EachWorldAnswersItsRequestsInOrderAndWelcomesAtFirst) {
  constexpr int kWorlds = 6;
  protocol::Client maker = makeClient("maker");
  for (int i = 0; i < kWorlds; ++i) create(maker, "w" + std::to_string(i));
  v1::ClientMessage subscribe;
  subscribe.mutable_subscribe()->set_notices(true);
  v1::StepMany many = makeStepMany(kWorlds, {subscribe, makeSpawnRequest(0), makeStepRequest(3)});
  many.mutable_worlds(2)
      ->mutable_requests(1)
      ->mutable_command()
      ->mutable_spawn()
      ->mutable_at()
      ->set_y(-9);
  const v1::StepManyReply first = request(maker, many);
  ASSERT_EQ(first.worlds_size(), kWorlds);
  for (int i = 0; i < kWorlds; ++i) {
    const auto& messages = first.worlds(i).messages();
    ASSERT_EQ(messages.size(), 5) << "welcome, subscribed, accepted, events, stepped";
    EXPECT_EQ(messages[0].welcome().world(), "w" + std::to_string(i));
    EXPECT_EQ(messages[1].reply_to(), 1u);
    EXPECT_EQ(messages[2].reply_to(), 2u);
    EXPECT_EQ(messages[3].events().notices(0).kind(),
              i == 2 ? v1::Notice::KIND_REFUSED : v1::Notice::KIND_SPAWNED);
    EXPECT_EQ(messages[4].reply_to(), 3u);
    EXPECT_EQ(messages[4].step().tick(), 3u);
    EXPECT_EQ(messages[4].step().avatars_size(), i == 2 ? 0 : 1);
    EXPECT_EQ(messages[4].step().state_hash() == first.worlds(0).messages(4).step().state_hash(),
              i != 2);
  }
  const v1::StepManyReply second = request(maker, makeStepMany(kWorlds, {makeStepRequest(1)}));
  for (const auto& world : second.worlds()) EXPECT_EQ(world.messages(0).step().tick(), 4u);
}

TEST_F(StepMany, PackedStepsReplaceRepliesToCommandsAndSteps) {
  protocol::Client maker = makeClient("maker");
  for (int i = 0; i < 4; ++i) create(maker, "w" + std::to_string(i));
  v1::StepMany spawn = makeStepMany(4, {makeSpawnRequest(0), makeStepRequest(1)});
  spawn.mutable_worlds(2)->clear_requests();
  request(maker, spawn);
  v1::StepMany many = makeStepMany(4, {makeDriveRequest(1), makeStepRequest(60)});
  for (const int i : {0, 2, 3}) many.mutable_worlds(i)->set_packed_avatar("ann");
  many.mutable_worlds(3)->mutable_requests(0)->mutable_command()->set_avatar("a name");
  const v1::StepManyReply reply = request(maker, many);
  ASSERT_EQ(reply.worlds(0).messages_size(), 0);
  ASSERT_EQ(reply.worlds(1).messages_size(), 2);
  ASSERT_EQ(reply.worlds(2).messages_size(), 0);  // it has no avatar: the Drive has no effect
  ASSERT_EQ(reply.worlds(3).messages_size(), 1);
  EXPECT_FALSE(reply.worlds(3).messages(0).command().accepted());
  const v1::StepReply& alone = reply.worlds(1).messages(1).step();
  const v1::PackedSteps& steps = reply.steps();
  ASSERT_EQ(steps.feet_size(), 12);
  ASSERT_EQ(steps.stopped_by_name_size(), 4);
  EXPECT_EQ(std::vector<std::uint64_t>(steps.tick().begin(), steps.tick().end()),
            (std::vector<std::uint64_t>{61, 0, 60, 61}));
  EXPECT_EQ(steps.state_hash(0), alone.state_hash());
  EXPECT_EQ(steps.feet(0), alone.avatars(0).feet().x());
  EXPECT_EQ(steps.feet(2), alone.avatars(0).feet().z());
  EXPECT_EQ(steps.stopped_by_name(0), alone.avatars(0).move().stopped_by_name());
  EXPECT_GT(steps.feet(0), 0.9);
  EXPECT_TRUE(std::isnan(steps.feet(6)));
  EXPECT_LT(steps.feet(9), 0.1) << "its Drive was refused";
  const v1::StepManyReply next = request(maker, makeStepMany(4, {makeStepRequest(1)}));
  EXPECT_FALSE(next.has_steps());
  EXPECT_EQ(next.worlds(0).messages(0).step().tick(), 62u);
}

TEST_F(StepMany, AClockThatItSetsRunsOn) {
  protocol::Client maker = makeClient("maker");
  create(maker, "w0");
  v1::ClientMessage freeRun;
  freeRun.mutable_set_clock()->mutable_free_run()->set_speed(100);
  request(maker, makeStepMany(1, {makeStepRequest(1)}));
  request(maker, makeStepMany(1, {freeRun}));
  EXPECT_TRUE(becomesTrue([&] {
    v1::ClientMessage message;
    message.mutable_list_worlds();
    const v1::ServerMessage reply = maker.request(std::move(message));
    for (const v1::World& world : reply.worlds().worlds())
      if (world.name() == "w0") return world.tick() > 20;
    return false;
  }));
}

TEST_F(StepMany, AttachmentsFollowOneAnotherOnMultiplesOf64) {
  protocol::Client maker = makeClient("maker");
  for (int i = 0; i < 3; ++i) create(maker, "w" + std::to_string(i));
  v1::ClientMessage scan;
  v1::RangeScan& rays = *scan.mutable_rays()->mutable_scan();
  rays.mutable_at()->set_y(1);
  rays.set_width(1);
  rays.set_columns(7);
  rays.set_rows(1);
  std::vector<std::uint8_t> attachment, alone;
  const v1::StepManyReply reply =
      request(maker, makeStepMany(3, {scan, makeStepRequest(1), scan}), &attachment);
  maker.request(scan, &alone);
  ASSERT_EQ(alone.size(), 56u);
  std::uint64_t before = 0;
  int scans = 0;
  for (const auto& world : reply.worlds()) {
    ASSERT_EQ(world.messages_size(), world.attachment_ends_size());
    for (int i = 0; i < world.messages_size(); ++i) {
      const std::uint64_t end = world.attachment_ends(i);
      if (!world.messages(i).has_rays()) {
        EXPECT_EQ(end, before);
        continue;
      }
      const std::uint64_t begin = (before + 63) / 64 * 64;
      ASSERT_EQ(end, begin + 56);
      EXPECT_EQ(std::memcmp(attachment.data() + begin, alone.data(), 56), 0);
      before = end;
      ++scans;
    }
  }
  EXPECT_EQ(scans, 6);
  EXPECT_EQ(attachment.size(), before);
}

TEST_F(StepMany, AConnectionLeavesItsWorldsByRequestAndAtItsEnd) {
  protocol::Client watcher = makeClient("watcher");
  {
    protocol::Client maker = makeClient("maker");
    for (int i = 0; i < 3; ++i) create(maker, "w" + std::to_string(i));
    v1::StepMany many = makeStepMany(3, {makeStepRequest(1)});
    many.mutable_worlds(1)->set_leave(true);
    request(maker, many);
    EXPECT_TRUE(becomesTrue([&] { return countWorlds(watcher) == 3; }));
    const v1::StepManyReply gone = request(maker, makeStepMany(3, {makeStepRequest(1)}));
    EXPECT_EQ(gone.worlds(1).messages(0).error().code(), v1::ERROR_UNKNOWN_WORLD);
    EXPECT_EQ(gone.worlds(2).messages(0).step().tick(), 2u);
  }
  EXPECT_TRUE(becomesTrue([&] { return countWorlds(watcher) == 1; }));
}

TEST_F(StepMany, WorldsThatAreDroppedMeanwhileAnswerWithErrors) {
  protocol::Client maker = makeClient("maker");
  for (int round = 0; round < (tests::kSanitized ? 3 : 10); ++round) {
    for (int i = 0; i < 4; ++i) create(maker, "w" + std::to_string(i));
    request(maker, makeStepMany(4, {makeStepRequest(1)}));
    std::thread dropper([&] {
      protocol::Client other = makeClient("dropper");
      v1::ClientMessage message;
      message.mutable_drop_world()->set_name("w1");
      other.request(std::move(message));
    });
    const v1::StepManyReply reply =
        request(maker, makeStepMany(4, {makeStepRequest(2000), makeStepRequest(1)}));
    dropper.join();
    for (int i = 0; i < 4; ++i) {
      int replies = 0;
      for (const auto& message : reply.worlds(i).messages()) replies += message.reply_to() != 0;
      EXPECT_EQ(replies, 2) << "world " << i;
      if (i != 1) {
        EXPECT_EQ(reply.worlds(i).messages().rbegin()->step().tick(), 2002u);
      }
    }
    v1::StepMany leave;
    for (int i = 0; i < 4; ++i) {
      leave.add_worlds()->set_world("w" + std::to_string(i));
      leave.mutable_worlds(i)->set_leave(true);
    }
    request(maker, leave);
    ASSERT_TRUE(becomesTrue([&] { return countWorlds(maker) == 1; }));
  }
}

TEST_F(StepMany, AServerEndsInTheMiddleOfOne) {
  protocol::Client maker = makeClient("maker");
  for (int i = 0; i < 4; ++i) create(maker, "w" + std::to_string(i));
  request(maker, makeStepMany(4, {makeStepRequest(1)}));
  {
    v1::StepMany many = makeStepMany(4, {makeStepRequest(30'000)});
    std::thread stepper([&] {
      try {
        request(maker, many);
      } catch (const std::exception&) {  // the connection ends under it
      }
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    server_->stop();
    stepper.join();
  }
}

}  // namespace
}  // namespace enfilade::server::testing
