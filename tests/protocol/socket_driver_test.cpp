#include "protocol/clients/cpp/socket_driver.hpp"

#include <gtest/gtest.h>

#include "tests/protocol/fake_world.hpp"
#include "tests/protocol/test_server.hpp"

namespace enfilade::protocol {
namespace {

constexpr const char* kTour = R"({"spawn":"ann","at":[1,0,0]}
{"spawn":"stuck","at":[2,0,0]}
{"walk":"ann","along":[[2,0,0],[3,0,0]]}
{"walk":"stuck","to":[3,0,0]}
{"capture":"ann","as":"hall"}
{"walk":"ann","to":[9,0,0],"speed":99}
{"wait":0.25}
{"capture":"ann","as":"hall2"}
{"wait":0.5,"for":"stuck"}
{"capture":"stuck","as":"hall3"}
{"leave":"ann"}
)";

/// Serves a world as the real server does, and logs the requested images.
struct FakeServer {
  FakeWorld world;
  std::vector<std::string> requestedFrames;
  v1::Subscribe subscription;
  bool lockstepRequested = false;
  bool stranger = false;  ///< another client's avatar is active, too

  void serve(TestConnection& connection) {
    connection.greet();
    while (const auto request = connection.receive()) {
      if (request->has_bye()) return;
      v1::ServerMessage reply;
      reply.set_reply_to(request->request_id());
      answer(*request, reply, connection);
      connection.send(reply);
    }
  }

  void answer(const v1::ClientMessage& request, v1::ServerMessage& reply,
              TestConnection& connection) {
    if (request.has_command()) {
      const auto error = world.submit(request.command());
      reply.mutable_command()->set_accepted(!error);
      if (error) *reply.mutable_command()->mutable_error() = *error;
    } else if (request.has_step()) {
      step(request.step(), *reply.mutable_step(), connection);
    } else if (request.has_frame()) {
      answerFrame(request.frame(), reply);
    } else if (request.has_set_clock()) {
      lockstepRequested = request.set_clock().has_lockstep();
      reply.mutable_set_clock();
    } else {
      subscription = request.subscribe();
      reply.mutable_subscribe();
    }
  }

  void step(const v1::Step& request, v1::StepReply& reply, TestConnection& connection) {
    StepOutcome outcome = world.step();
    if (stranger) addStranger(outcome);
    v1::ServerMessage events;
    for (const auto& contact : outcome.contacts) *events.mutable_events()->add_contacts() = contact;
    for (const auto& notice : outcome.notices) *events.mutable_events()->add_notices() = notice;
    if (events.has_events()) connection.send(events);
    reply.set_tick(outcome.tick);
    reply.set_time(outcome.time);
    reply.set_state_hash(outcome.stateHash);
    reply.set_idle(outcome.idle);
    if (!request.avatars()) return;
    for (const auto& avatar : outcome.avatars) *reply.add_avatars() = avatar;
  }

  static void addStranger(StepOutcome& outcome) {
    v1::Notice notice;
    notice.set_kind(v1::Notice::KIND_CAPTURE);
    notice.set_avatar("stranger");
    outcome.notices.push_back(notice);
    for (const auto& [a, b] : {std::pair{11u, 12u}, {11u, 13u}, {12u, 3u}, {13u, 3u}}) {
      v1::ContactEvent contact;
      contact.set_a(a);
      contact.set_b(b);
      contact.set_a_name(a == 12 ? "stranger" : a == 11 ? "passer-by" : "ann");
      contact.set_b_name(b == 12 ? "stranger" : "ann");  // object 3 has an avatar's name
      outcome.contacts.push_back(contact);
    }
  }

  void answerFrame(const v1::FrameRequest& request, v1::ServerMessage& reply) {
    requestedFrames.push_back(request.eyes().avatar() + " " + std::to_string(request.tick()));
    if (request.tick() != world.getTick()) {
      reply.mutable_error()->set_code(v1::ERROR_TICK_GONE);
    } else if (request.eyes().avatar() == "stuck") {
      reply.mutable_error()->set_code(v1::ERROR_NO_RENDERER);
      reply.mutable_error()->set_message("no EGL here");
    } else {
      reply.mutable_frame()->set_tick(request.tick());
      reply.mutable_frame()->set_width(request.width());
    }
  }
};

TEST(SocketDriver, AScriptRunsAsItDoesInProcess) {
  const Script script = parseScript(kTour, "tour.jsonl");
  FakeWorld inProcess;
  std::vector<std::string> framesInProcess;
  const ScriptResult here =
      runScript(script, inProcess, [&](StepOutcome& outcome, const ScriptProgress&) {
        for (const CapturedFrame& frame : outcome.frames) {
          framesInProcess.push_back(frame.avatar + " " + std::to_string(outcome.tick));
        }
      });
  FakeServer fake;
  ScriptResult there;
  {
    const TestServer server([&](TestConnection& connection) { fake.serve(connection); });
    Client client("127.0.0.1", server.getPort());
    SocketDriver driver(client);
    there = runScript(script, driver, [](StepOutcome& outcome, const ScriptProgress&) {
      EXPECT_FALSE(outcome.avatars.empty());
    });
  }
  EXPECT_EQ(fake.world.getDiary(), inProcess.getDiary());
  EXPECT_EQ(there.stateHash, here.stateHash);
  EXPECT_EQ(there.ticks, here.ticks);
  EXPECT_EQ(there.refused, 1u);
  EXPECT_EQ(there.blocked, here.blocked);
  EXPECT_EQ(there.arrived, here.arrived);
  EXPECT_EQ(fake.requestedFrames, framesInProcess);
  EXPECT_EQ(framesInProcess.size(), 3u);
  EXPECT_EQ(there.captured, 2u);
  EXPECT_EQ(there.uncaptured, 1u);
  EXPECT_NE(there.outcomes.back().text.find("no EGL here"), std::string::npos);
}

TEST(SocketDriver, SetsTheClockAndSubscribes) {
  FakeServer fake;
  {
    const TestServer server([&](TestConnection& connection) { fake.serve(connection); });
    Client client("127.0.0.1", server.getPort());
    const SocketDriver driver(client);
    EXPECT_DOUBLE_EQ(driver.tickSeconds(), 1.0 / 60.0);
  }
  EXPECT_TRUE(fake.lockstepRequested);
  EXPECT_TRUE(fake.subscription.contacts());
  EXPECT_TRUE(fake.subscription.notices());
}

TEST(SocketDriver, NoticesOfOtherClientsAvatarsAreIgnored) {
  FakeServer fake;
  fake.stranger = true;
  const TestServer server([&](TestConnection& connection) { fake.serve(connection); });
  Client client("127.0.0.1", server.getPort());
  SocketDriver driver(client);
  const Script script = parseScript(R"({"spawn":"ann","at":[1,0,0]})", "tour.jsonl");
  EXPECT_FALSE(driver.submit(std::get<v1::Command>(script.lines.at(0).action)));
  const StepOutcome outcome = driver.step();
  ASSERT_EQ(outcome.notices.size(), 1u);
  EXPECT_EQ(outcome.notices[0].avatar(), "ann");
  EXPECT_TRUE(outcome.frames.empty());
  ASSERT_EQ(outcome.contacts.size(), 2u);
  EXPECT_EQ(outcome.contacts[0].b(), 13u);  // ann met the passer-by,
  EXPECT_EQ(outcome.contacts[1].a(), 13u);  // and an object
}

TEST(SocketDriver, ACaptureIsRequestedInItsFormat) {
  v1::Notice notice;
  notice.set_avatar("ann");
  notice.set_tick(17);
  CaptureFormat format;
  format.width = 320;
  format.height = 200;
  format.channels = {v1::CHANNEL_IDS, v1::CHANNEL_RGB};
  format.rgbEncoding = v1::ENCODING_PNG;
  format.samples = 4;
  const v1::FrameRequest request = makeCaptureRequest(notice, format);
  EXPECT_EQ(request.eyes().avatar(), "ann");
  EXPECT_EQ(request.tick(), 17u);
  EXPECT_EQ(request.width(), 320u);
  EXPECT_EQ(request.height(), 200u);
  EXPECT_EQ(request.channels_size(), 2);
  EXPECT_EQ(request.channels(0), v1::CHANNEL_IDS);
  EXPECT_EQ(request.rgb_encoding(), v1::ENCODING_PNG);
  EXPECT_EQ(request.samples(), 4u);
}

}  // namespace
}  // namespace enfilade::protocol
