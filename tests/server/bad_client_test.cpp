// Tests of clients that break the rules: each gets a clear error or is disconnected, and no other
// client is affected.
#include <thread>

#include "tests/server/raw_connection.hpp"
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

class BadClients : public ServedRoom {
 protected:
  /// The server still serves: an existing client continues, and a new one may connect.
  void expectOthersGoOn(protocol::Client& other) {
    const std::uint64_t tick = other.step().tick();
    EXPECT_EQ(makeClient("newcomer").welcome().tick(), tick);
  }
};

TEST_F(BadClients, WrongMagicIsAnsweredWithAnError) {
  serve();
  protocol::Client other = makeClient("other");
  RawConnection raw(server_->port());
  raw.send("EHLO there\r\n");
  const RawConnection::End end = raw.readToEnd();
  EXPECT_EQ(end.error.code(), v1::ERROR_BAD_MESSAGE);
  EXPECT_EQ(end.bye.code(), v1::ERROR_BAD_MESSAGE);
  expectOthersGoOn(other);
}

TEST_F(BadClients, AnOversizedMessageIsRefusedByItsLengthAlone) {
  serve();
  protocol::Client other = makeClient("other");
  RawConnection raw(server_->port());
  raw.sendHello();
  raw.send(std::vector<std::uint8_t>{0xFF, 0xFF, 0xFF, 0x7F, 0, 0, 0, 0});
  EXPECT_EQ(raw.readToEnd().error.code(), v1::ERROR_TOO_LARGE);
  expectOthersGoOn(other);
}

TEST_F(BadClients, BytesThatAreNoMessageAreRefused) {
  serve();
  protocol::Client other = makeClient("other");
  RawConnection raw(server_->port());
  raw.sendHello();
  raw.send(std::vector<std::uint8_t>{8, 0, 0, 0, 4, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF});
  EXPECT_EQ(raw.readToEnd().error.code(), v1::ERROR_BAD_MESSAGE);
  expectOthersGoOn(other);
}

TEST_F(BadClients, TheFirstMessageHasToBeHello) {
  serve();
  RawConnection raw(server_->port());
  raw.sendMagic();
  v1::ClientMessage step;
  step.set_request_id(7);
  step.mutable_step()->set_ticks(1);
  raw.send(step);
  const auto error = raw.receive();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->reply_to(), 7u);
  EXPECT_EQ(error->error().code(), v1::ERROR_BAD_MESSAGE);
  EXPECT_EQ(makeClient("other").step().tick(), 1u) << "no tick was made";
}

TEST_F(BadClients, ARequestNeedsANumberForItsAnswer) {
  serve();
  RawConnection raw(server_->port());
  raw.sendHello();
  ASSERT_TRUE(raw.receive()->has_welcome());
  v1::ClientMessage step;
  step.mutable_step()->set_ticks(1);
  raw.send(step);
  EXPECT_EQ(raw.readToEnd().error.code(), v1::ERROR_BAD_MESSAGE);
  EXPECT_EQ(makeClient("other").step().tick(), 1u) << "no tick was made";
}

TEST_F(BadClients, AnotherMajorVersionIsRefused) {
  serve();
  for (const char* version : {"2.0.0", "0.9.0", "", "one", "1"}) {
    RawConnection raw(server_->port());
    raw.sendHello(version);
    EXPECT_EQ(raw.readToEnd().error.code(), v1::ERROR_VERSION) << version;
  }
  RawConnection minor(server_->port());
  minor.sendHello("1.7.3");
  EXPECT_TRUE(minor.receive()->has_welcome());
}

TEST_F(BadClients, AMessageCutShortByClosingAffectsNoOtherClient) {
  serve();
  protocol::Client other = makeClient("other");
  {
    RawConnection raw(server_->port());
    raw.sendHello();
    raw.send(std::vector<std::uint8_t>{100, 0, 0, 0, 50, 0, 0, 0, 1, 2, 3});
    raw.closeSending();
    EXPECT_TRUE(raw.readToEnd().closed);
  }
  expectOthersGoOn(other);
}

TEST_F(BadClients, SilenceBeforeHelloEndsTheConnection) {
  ServerLimits limits;
  limits.helloTimeout = std::chrono::milliseconds(50);
  serve(limits);
  RawConnection raw(server_->port());
  EXPECT_EQ(raw.readToEnd().error.code(), v1::ERROR_TIMEOUT);
}

TEST_F(BadClients, HalfAMessageAndThenSilenceEndsTheConnection) {
  ServerLimits limits;
  limits.messageTimeout = std::chrono::milliseconds(50);
  serve(limits);
  RawConnection raw(server_->port());
  raw.sendHello();
  ASSERT_TRUE(raw.receive()->has_welcome());
  raw.send(std::vector<std::uint8_t>{100, 0, 0, 0, 50, 0, 0, 0, 1, 2, 3});
  EXPECT_EQ(raw.readToEnd().error.code(), v1::ERROR_TIMEOUT);
}

TEST_F(BadClients, SilenceBetweenMessagesIsNoFault) {
  ServerLimits limits;
  limits.helloTimeout = limits.messageTimeout = std::chrono::milliseconds(30);
  serve(limits);
  protocol::Client quiet = makeClient("quiet");
  std::this_thread::sleep_for(std::chrono::milliseconds(120));
  EXPECT_EQ(quiet.step().tick(), 1u);
}

TEST_F(BadClients, AClientThatDoesNotReadIsDisconnectedAlone) {
  ServerLimits limits;
  limits.outgoingBytes = 64 << 10;
  limits.sendBuffer = 4096;
  limits.closeTimeout = std::chrono::milliseconds(200);
  serve(limits);
  protocol::Client other = makeClient("other");
  RawConnection raw(server_->port());
  raw.sendHello();
  v1::ClientMessage question;
  question.set_request_id(2);
  for (int i = 0; i < 2000; ++i) question.mutable_describe()->add_ids(kWall);
  // Requests far more than sockets and queue together can hold, and reads nothing. Sending fails
  // once the server has closed.
  bool cutOff = false;
  for (int i = 0; i < 20'000 && !cutOff; ++i) {
    cutOff = !raw.send(question);
    if (i > 1000) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(cutOff);
  expectOthersGoOn(other);
}

TEST_F(BadClients, AClientThatFloodsIsThrottledAndGetsAllReplies) {
  constexpr std::uint64_t kQuestions = 3000;
  ServerLimits limits;
  limits.pendingRequestBytes = 100;
  serve(limits);
  protocol::Client other = makeClient("other");
  RawConnection raw(server_->port());
  raw.sendHello();
  ASSERT_TRUE(raw.receive()->has_welcome());
  std::thread asker([&] {
    for (std::uint64_t id = 2; id < 2 + kQuestions; ++id) {
      v1::ClientMessage question;
      question.set_request_id(id);
      question.mutable_metrics();
      raw.send(question);
    }
  });
  for (std::uint64_t id = 2; id < 2 + kQuestions; ++id) {
    const auto reply = raw.receive();
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->reply_to(), id);
    EXPECT_TRUE(reply->has_metrics());
  }
  asker.join();
  expectOthersGoOn(other);
}

TEST_F(BadClients, ByeFollowsTheRepliesToAllRequests) {
  serve();
  RawConnection raw(server_->port());
  raw.sendHello();
  ASSERT_TRUE(raw.receive()->has_welcome());
  v1::ClientMessage step, bye;
  step.mutable_step()->set_ticks(100);
  bye.mutable_bye();
  for (const std::uint64_t id : {2, 3}) {
    step.set_request_id(id);
    raw.send(step);
  }
  raw.send(bye);
  raw.send(step);  // too late: the server no longer reads
  for (const std::uint64_t id : {2, 3}) {
    const auto reply = raw.receive();
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->reply_to(), id);
    EXPECT_EQ(reply->step().tick(), 100 * (id - 1));
  }
  const auto last = raw.receive();
  ASSERT_TRUE(last);
  EXPECT_TRUE(last->has_bye());
  EXPECT_FALSE(raw.receive());
}

TEST_F(BadClients, BytesThatDripInEndTheConnectionAllTheSame) {
  ServerLimits limits;
  limits.messageTimeout = std::chrono::milliseconds(100);
  serve(limits);
  RawConnection raw(server_->port());
  raw.sendHello();
  ASSERT_TRUE(raw.receive()->has_welcome());
  raw.send(std::vector<std::uint8_t>{100, 0, 0, 0, 50, 0, 0, 0});
  bool cutOff = false;
  for (int i = 0; i < 92 && !cutOff; ++i) {
    cutOff = !raw.send(std::vector<std::uint8_t>{0});
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(raw.readToEnd().error.code(), v1::ERROR_TIMEOUT);
}

TEST_F(BadClients, ASilentConnectionIsEvictedForANewOne) {
  ServerLimits limits;
  limits.connections = 3;
  serve(limits);
  protocol::Client ann = makeClient("ann");
  RawConnection first(server_->port()), second(server_->port());
  protocol::Client bob = makeClient("bob");
  EXPECT_FALSE(first.receive()) << "closed as the oldest silent connection";
  second.sendHello();
  EXPECT_TRUE(second.receive()->has_welcome()) << "there was no need to close this one";
  RawConnection late(server_->port());
  EXPECT_EQ(late.readToEnd().bye.code(), v1::ERROR_NOT_ALLOWED) << "all connections are registered";
  EXPECT_EQ(ann.step().tick(), 1u);
}

TEST_F(BadClients, ConnectionsAboveTheLimitAreRefused) {
  ServerLimits limits;
  limits.connections = 2;
  serve(limits);
  protocol::Client ann = makeClient("ann"), bob = makeClient("bob");
  RawConnection third(server_->port());
  EXPECT_EQ(third.readToEnd().bye.code(), v1::ERROR_NOT_ALLOWED);
  EXPECT_EQ(ann.step().tick(), 1u);
}

TEST_F(BadClients, ManyVisitsOfNoiseLeaveTheServerServing) {
  serve();
  protocol::Client other = makeClient("other");
  std::uint32_t seed = 12345;
  for (int visit = 0; visit < 50; ++visit) {
    RawConnection raw(server_->port());
    if (visit % 2 == 0) raw.sendHello();
    std::vector<std::uint8_t> noise(200);
    for (std::uint8_t& byte : noise) {
      seed = seed * 1664525u + 1013904223u;
      byte = static_cast<std::uint8_t>(seed >> 24);
    }
    raw.send(noise);
  }
  expectOthersGoOn(other);
}

TEST_F(BadClients, AWorldHasRoomForSoManyAvatars) {
  ServerLimits limits;
  limits.avatars = 2;
  limits.waypoints = 2;
  serve(limits);
  protocol::Client ann = makeClient("ann");
  EXPECT_FALSE(ann.command(spawn("a", 0, 0.01, 0)));
  EXPECT_FALSE(ann.command(spawn("b", 2, 0.01, 0)));
  EXPECT_EQ(ann.command(spawn("c", 4, 0.01, 0))->code(), v1::ERROR_TOO_LARGE);
  v1::Command walk = walkTo("a", 1, 0, 0);
  *walk.mutable_walk()->add_along() = makeVec(2, 0, 0);
  EXPECT_FALSE(ann.command(walk));
  *walk.mutable_walk()->add_along() = makeVec(3, 0, 0);
  EXPECT_EQ(ann.command(walk)->code(), v1::ERROR_TOO_LARGE);
}

}  // namespace
}  // namespace enfilade::server::testing
