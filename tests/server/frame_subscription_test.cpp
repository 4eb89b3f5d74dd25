// Tests of subscriptions to images.
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

class FrameSubscriptions : public ServedRoom {
 protected:
  void SetUp() override {
    serve();
    ENFILADE_NEED_PICTURES(*server_);
  }
  static v1::ClientMessage makeWatchFrames(std::uint32_t number, double rate) {
    v1::ClientMessage message;
    v1::WatchFrames& watch = *message.mutable_watch_frames();
    watch.set_watch(number);
    watch.set_rate(rate);
    watch.mutable_frame()->set_width(8);
    watch.mutable_frame()->set_height(8);
    watch.mutable_frame()->mutable_free()->mutable_forward()->set_x(1);
    return message;
  }
  static std::optional<v1::Frame> awaitFrame(protocol::Client& client, int patienceMs = 20'000) {
    const auto event = client.nextEvent(std::chrono::milliseconds(patienceMs));
    if (!event || !event->has_frame()) return std::nullopt;
    return event->frame();
  }
  static v1::ErrorCode catchCode(protocol::Client& client, const v1::ClientMessage& message) {
    try {
      client.request(message);
    } catch (const protocol::ProtocolError& error) {
      return error.code;
    }
    return v1::ERROR_UNSPECIFIED;
  }
};

TEST_F(FrameSubscriptions, OneComesAtOnceAndThenOneATick) {
  protocol::Client ann = makeClient("ann");
  ann.request(makeWatchFrames(3, 0));
  const auto first = awaitFrame(ann);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->watch(), 3u);
  EXPECT_EQ(first->tick(), 0u);
  ann.step();
  EXPECT_EQ(awaitFrame(ann).value().tick(), 1u);
}

TEST_F(FrameSubscriptions, OmittedFramesAreCounted) {
  protocol::Client ann = makeClient("ann");
  ann.request(makeWatchFrames(1, 0));
  ann.step(500);
  std::uint64_t counted = 0, last = 0;
  while (last < 500) {
    const auto frame = awaitFrame(ann, 300);
    if (!frame) {  // the last tick was skipped while another was drawn
      last = ann.step().tick() - 1;
      continue;
    }
    EXPECT_GE(frame->tick(), last);
    counted += 1 + frame->dropped();
    last = frame->tick();
    EXPECT_LE(counted, last + 1) << "each tick has one image, sent or dropped";
  }
  EXPECT_LT(counted, 503u);
}

TEST_F(FrameSubscriptions, ARateIsOfSimulatedTime) {
  protocol::Client ann = makeClient("ann");
  ann.request(makeWatchFrames(1, 2));
  EXPECT_EQ(awaitFrame(ann).value().tick(), 0u);
  std::vector<std::uint64_t> ticks;
  for (int tick = 1; tick <= 62; ++tick) {
    ann.step();
    if (tick % 30 == 0) ticks.push_back(awaitFrame(ann).value().tick());
  }
  EXPECT_EQ(ticks, (std::vector<std::uint64_t>{30, 60}));
  EXPECT_FALSE(awaitFrame(ann, 50)) << "and no others";
}

TEST_F(FrameSubscriptions, AnAvatarMayComeLaterAndAWatchEnds) {
  protocol::Client ann = makeClient("ann");
  v1::ClientMessage eyes = makeWatchFrames(1, 0);
  eyes.mutable_watch_frames()->mutable_frame()->mutable_eyes()->set_avatar("ann");
  ann.request(eyes);
  ann.step();
  EXPECT_FALSE(awaitFrame(ann, 50));
  ann.command(spawn("ann", 0, 0.01, 0));
  ann.step();
  EXPECT_EQ(awaitFrame(ann).value().tick(), 2u);
  v1::ClientMessage none;
  none.mutable_watch_frames()->set_watch(1);
  ann.request(none);
  ann.step();
  EXPECT_FALSE(awaitFrame(ann, 50));
}

TEST_F(FrameSubscriptions, InvalidWatchesAreRefused) {
  protocol::Client ann = makeClient("ann");
  EXPECT_EQ(catchCode(ann, makeWatchFrames(0, 0)), v1::ERROR_BAD_MESSAGE);
  EXPECT_EQ(catchCode(ann, makeWatchFrames(17, 0)), v1::ERROR_BAD_MESSAGE);
  EXPECT_EQ(catchCode(ann, makeWatchFrames(1, -1)), v1::ERROR_BAD_MESSAGE);
  v1::ClientMessage huge = makeWatchFrames(1, 0);
  huge.mutable_watch_frames()->mutable_frame()->set_width(5000);
  EXPECT_EQ(catchCode(ann, huge), v1::ERROR_BAD_CAMERA);
}

}  // namespace
}  // namespace enfilade::server::testing
