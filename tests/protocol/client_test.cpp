#include "protocol/clients/cpp/client.hpp"

#include <gtest/gtest.h>

#include "tests/protocol/test_server.hpp"

namespace enfilade::protocol {
namespace {

constexpr std::chrono::milliseconds kShort{150};  // timeout for servers that stay silent

Client connectTo(const TestServer& server,
                 std::chrono::milliseconds timeout = ClientOptions{}.timeout) {
  ClientOptions options;
  options.name = "client test";
  options.timeout = timeout;
  return Client("127.0.0.1", server.getPort(), options);
}

/// The exception's message; fails the test if nothing was thrown.
template <typename Exception, typename Action>
std::string catchMessage(Action action) {
  try {
    action();
  } catch (const Exception& thrown) {
    return thrown.what();
  }
  ADD_FAILURE() << "no exception of this type was thrown";
  return "";
}

template <typename Action>
void expectConnectionError(const TestServer& server, const std::string& part, Action action) {
  const std::string what = catchMessage<ConnectionError>(action);
  EXPECT_NE(what.find(part), std::string::npos) << what;
  EXPECT_NE(what.find("127.0.0.1:" + std::to_string(server.getPort())), std::string::npos) << what;
}

v1::ServerMessage replyTo(const v1::ClientMessage& request) {
  v1::ServerMessage reply;
  reply.set_reply_to(request.request_id());
  return reply;
}

// ---- greeting ----------------------------------------------------------------------------------

TEST(Client, GreetsAndIsWelcomed) {
  v1::ClientMessage hello;
  bool saidBye = false;
  {
    const TestServer server([&](TestConnection& connection) {
      hello = connection.greet();
      const auto last = connection.receive();
      saidBye = last && last->has_bye();
    });
    const Client client = connectTo(server);
    EXPECT_EQ(client.welcome().scene().objects(), 10u);
  }
  EXPECT_EQ(hello.hello().protocol_version(), kVersion);
  EXPECT_EQ(hello.hello().client_name(), "client test");
  EXPECT_GT(hello.request_id(), 0u);
  EXPECT_TRUE(saidBye);
}

TEST(Client, RefusesAServerOfAnotherMajorVersion) {
  for (const std::string version : {"2.0.0", "", "1", "x.1", "10.0.0"}) {
    const TestServer server([&](TestConnection& connection) {
      v1::ServerMessage reply = makeWelcomeTo(*connection.receive());
      reply.mutable_welcome()->set_protocol_version(version);
      connection.sendRaw(std::span<const std::uint8_t>(kMagic));
      connection.send(reply);
      connection.waitUntilClosed();
    });
    try {
      connectTo(server);
      ADD_FAILURE() << version;
    } catch (const ProtocolError& error) {
      EXPECT_EQ(error.code, v1::ERROR_VERSION);
      EXPECT_NE(std::string(error.what()).find("\"" + version + "\""), std::string::npos);
    }
  }
}

TEST(Client, AcceptsALaterMinorVersionAndUnknownFields) {
  const TestServer server([](TestConnection& connection) {
    v1::ServerMessage reply = makeWelcomeTo(*connection.receive());
    reply.mutable_welcome()->set_protocol_version("1.99.0");
    auto* unknown =
        reply.mutable_welcome()->GetReflection()->MutableUnknownFields(reply.mutable_welcome());
    unknown->AddLengthDelimited(1000, "from the future");
    connection.sendRaw(std::span<const std::uint8_t>(kMagic));
    connection.send(reply);
    connection.waitUntilClosed();
  });
  EXPECT_EQ(connectTo(server).welcome().protocol_version(), "1.99.0");
}

TEST(Client, ReportsWhyAServerRefusedTheGreeting) {
  const TestServer server([](TestConnection& connection) {
    v1::ServerMessage reply = replyTo(*connection.receive());
    reply.mutable_error()->set_code(v1::ERROR_VERSION);
    reply.mutable_error()->set_message("too old");
    connection.sendRaw(std::span<const std::uint8_t>(kMagic));
    connection.send(reply);
    connection.waitUntilClosed();
  });
  EXPECT_NE(catchMessage<ProtocolError>([&] { connectTo(server); }).find("too old"),
            std::string::npos);
}

TEST(Client, RefusesAWelcomeWithoutATick) {
  const TestServer server([](TestConnection& connection) {
    v1::ServerMessage reply = makeWelcomeTo(*connection.receive());
    reply.mutable_welcome()->mutable_policies()->clear_tick();
    connection.sendRaw(std::span<const std::uint8_t>(kMagic));
    connection.send(reply);
    connection.waitUntilClosed();
  });
  EXPECT_THROW(connectTo(server), ProtocolError);
}

TEST(Client, NamesHostAndPortIfNoServerListens) {
  std::uint16_t port = 0;
  {
    const TestServer server([](TestConnection&) {});
    port = server.getPort();
  }
  const std::string what = catchMessage<ConnectionError>([&] { Client("127.0.0.1", port); });
  EXPECT_NE(what.find("cannot connect to 127.0.0.1:" + std::to_string(port)), std::string::npos);
}

TEST(Client, RefusesAnotherProtocolByItsFirstBytes) {
  const TestServer server([](TestConnection& connection) {
    connection.receive();
    connection.sendRaw("HTTP/1.1 400 Bad Request\r\n\r\n");
    connection.waitUntilClosed();
  });
  expectConnectionError(server, "does not speak this protocol", [&] { connectTo(server); });
}

// ---- silence and ends --------------------------------------------------------------------------

TEST(Client, DoesNotWaitForeverForAWelcome) {
  const TestServer server([](TestConnection& connection) { connection.waitUntilClosed(); });
  expectConnectionError(server, "did not answer the greeting", [&] { connectTo(server, kShort); });
}

TEST(Client, DoesNotWaitForeverForAReply) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    connection.waitUntilClosed();
  });
  Client client = connectTo(server, kShort);
  expectConnectionError(server, "did not answer within 150 ms", [&] { client.step(); });
  // The reply may still arrive, so no further request is possible.
  expectConnectionError(server, "did not answer within 150 ms", [&] { client.metrics(); });
}

TEST(Client, EventsWithoutAnEndDoNotReplaceAReply) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    const auto request = connection.receive();
    for (std::uint64_t i = 1; i <= 10; ++i) connection.send(makeEvents(i));
    connection.waitUntilClosed();
  });
  Client client = connectTo(server, kShort);
  expectConnectionError(server, "did not answer", [&] { client.step(); });
  EXPECT_EQ(client.takeEvents().size(), 10u);
}

TEST(Client, ReportsAServerThatClosesBeforeItReplies) {
  const TestServer server([](TestConnection& connection) { connection.receive(); });
  expectConnectionError(server, "closed the connection before it answered",
                        [&] { connectTo(server); });
}

TEST(Client, ReportsAServerThatClosesInTheMiddleOfAMessage) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    const auto request = connection.receive();
    v1::ServerMessage reply = replyTo(*request);
    reply.mutable_step()->set_tick(1);
    auto bytes = encode(reply);
    bytes.pop_back();
    connection.sendRaw(std::span<const std::uint8_t>(bytes));
  });
  Client client = connectTo(server);
  expectConnectionError(server, "in the middle of a message", [&] { client.step(); });
}

TEST(Client, RepeatsTheServersFinalMessage) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    connection.receive();
    v1::ServerMessage bye;
    bye.mutable_bye()->set_code(v1::ERROR_SHUTTING_DOWN);
    bye.mutable_bye()->set_reason("the lights go out");
    connection.send(makeEvents(1));
    connection.send(bye);
  });
  Client client = connectTo(server);
  expectConnectionError(server, "the lights go out", [&] { client.step(); });
  const auto events = client.takeEvents();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_TRUE(events[0].has_events());
  EXPECT_EQ(events[1].bye().code(), v1::ERROR_SHUTTING_DOWN);
}

TEST(Client, AnErrorOfTheConnectionEndsIt) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    connection.receive();
    v1::ServerMessage error;
    error.mutable_error()->set_code(v1::ERROR_TOO_SLOW);
    error.mutable_error()->set_message("you do not read");
    connection.send(error);
    connection.waitUntilClosed();
  });
  Client client = connectTo(server);
  EXPECT_THROW(client.command({}), ProtocolError);
  EXPECT_THROW(client.step(), ConnectionError);
}

TEST(Client, RefusesAMessageAboveItsLimit) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    connection.receive();
    connection.send(v1::ServerMessage{}, std::vector<std::uint8_t>(1000));
    connection.waitUntilClosed();
  });
  ClientOptions options;
  options.limits = {500, 500};
  Client client("127.0.0.1", server.getPort(), options);
  expectConnectionError(server, "exceeds the limit of 500", [&] { client.step(); });
}

TEST(Client, RefusesBytesThatAreNoMessage) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    connection.receive();
    const std::vector<std::uint8_t> bytes{6, 0, 0, 0, 2, 0, 0, 0, 0xFF, 0xFF};
    connection.sendRaw(std::span<const std::uint8_t>(bytes));
    connection.waitUntilClosed();
  });
  Client client = connectTo(server);
  expectConnectionError(server, "not a ServerMessage", [&] { client.step(); });
}

// ---- requests ----------------------------------------------------------------------------------

TEST(Client, EventsThatComeBeforeAReplyAreKeptInOrder) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    const auto request = connection.receive();
    connection.send(makeEvents(1));
    connection.send(makeEvents(2));
    v1::ServerMessage reply = replyTo(*request);
    reply.mutable_step()->set_tick(request->step().ticks());
    connection.send(reply);
    connection.send(makeEvents(3));
    connection.waitUntilClosed();
  });
  Client client = connectTo(server);
  EXPECT_EQ(client.step(42).tick(), 42u);
  EXPECT_EQ(client.nextEvent(kShort)->events().sequence(), 1u);
  EXPECT_EQ(client.nextEvent(kShort)->events().sequence(), 2u);
  EXPECT_EQ(client.nextEvent(std::chrono::seconds(30))->events().sequence(), 3u);
  EXPECT_FALSE(client.nextEvent(kShort));
}

TEST(Client, ATimeoutKeepsAnIncompleteMessage) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    const auto bytes = encode(makeEvents(7));
    const std::span<const std::uint8_t> whole(bytes);
    connection.sendRaw(whole.first(5));
    const auto request = connection.receive();  // sent after the wait timed out
    connection.sendRaw(whole.subspan(5));
    v1::ServerMessage reply = replyTo(*request);
    reply.mutable_step();
    connection.send(reply);
    connection.waitUntilClosed();
  });
  Client client = connectTo(server);
  EXPECT_FALSE(client.nextEvent(kShort));
  client.step();
  const auto events = client.takeEvents();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].events().sequence(), 7u);
}

TEST(Client, ACommandIsAcceptedOrRefusedWithItsField) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    v1::ServerMessage taken = replyTo(*connection.receive());
    taken.mutable_command()->set_accepted(true);
    connection.send(taken);
    v1::ServerMessage refused = replyTo(*connection.receive());
    refused.mutable_command()->mutable_error()->set_field("walk.speed");
    connection.send(refused);
    v1::ServerMessage failed = replyTo(*connection.receive());
    failed.mutable_error()->set_code(v1::ERROR_NOT_ALLOWED);
    connection.send(failed);
    connection.waitUntilClosed();
  });
  Client client = connectTo(server);
  EXPECT_FALSE(client.command({}));
  EXPECT_EQ(client.command({})->field(), "walk.speed");
  EXPECT_EQ(client.command({})->code(), v1::ERROR_NOT_ALLOWED);
}

TEST(Client, AnErrorReplyIsThrownAndTheConnectionContinues) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    v1::ServerMessage reply = replyTo(*connection.receive());
    reply.mutable_error()->set_code(v1::ERROR_NOT_ALLOWED);
    reply.mutable_error()->set_field("step.ticks");
    connection.send(reply);
    reply = replyTo(*connection.receive());
    reply.mutable_metrics()->set_ticks(5);
    connection.send(reply);
    connection.waitUntilClosed();
  });
  Client client = connectTo(server);
  try {
    client.step();
    ADD_FAILURE();
  } catch (const ProtocolError& error) {
    EXPECT_EQ(error.code, v1::ERROR_NOT_ALLOWED);
    EXPECT_EQ(error.field, "step.ticks");
  }
  EXPECT_EQ(client.metrics().ticks(), 5u);
}

TEST(Client, AReplyOfAnotherKindIsAnError) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    v1::ServerMessage reply = replyTo(*connection.receive());
    reply.mutable_metrics();
    connection.send(reply);
    connection.waitUntilClosed();
  });
  Client client = connectTo(server);
  EXPECT_THROW(client.step(), ProtocolError);
}

TEST(Client, AReplyToAnotherRequestBreaksTheConnection) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    v1::ServerMessage reply = replyTo(*connection.receive());
    reply.set_reply_to(reply.reply_to() + 1);
    reply.mutable_step();
    connection.send(reply);
    connection.waitUntilClosed();
  });
  Client client = connectTo(server);
  expectConnectionError(server, "instead of", [&] { client.step(); });
}

TEST(Client, AFrameGivesItsPlanes) {
  const std::vector<std::uint8_t> pixels{1, 2, 3, 4, 5, 6, 7};
  const TestServer server([&](TestConnection& connection) {
    connection.greet();
    for (const std::uint64_t length : {4u, 5u}) {
      v1::ServerMessage reply = replyTo(*connection.receive());
      v1::Plane* rgb = reply.mutable_frame()->add_planes();
      rgb->set_channel(v1::CHANNEL_RGB);
      rgb->set_length(3);
      v1::Plane* ids = reply.mutable_frame()->add_planes();
      ids->set_channel(v1::CHANNEL_IDS);
      ids->set_offset(3);
      ids->set_length(length);
      connection.send(reply, pixels);
    }
    connection.waitUntilClosed();
  });
  Client client = connectTo(server);
  const ReceivedFrame frame = client.frame({});
  const auto ids = frame.plane(v1::CHANNEL_IDS);
  EXPECT_EQ(std::vector<std::uint8_t>(ids.begin(), ids.end()),
            (std::vector<std::uint8_t>{4, 5, 6, 7}));
  EXPECT_TRUE(frame.plane(v1::CHANNEL_DEPTH).empty());
  // The second frame's plane ends one byte beyond its attachment.
  EXPECT_THROW(client.frame({}), ProtocolError);
}

TEST(Client, AFrameOfManyMegabytesComesWhole) {
  std::vector<std::uint8_t> pixels(12u << 20);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(i * 7 >> 3);
  const TestServer server([&](TestConnection& connection) {
    connection.greet();
    v1::ServerMessage reply = replyTo(*connection.receive());
    reply.mutable_frame();
    connection.send(reply, pixels);
    connection.waitUntilClosed();
  });
  EXPECT_EQ(connectTo(server).frame({}).pixels, pixels);
}

TEST(Client, MovesAsAValue) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    v1::ServerMessage reply = replyTo(*connection.receive());
    reply.mutable_names()->add_entities()->set_name("Hall");
    connection.send(reply);
    connection.waitUntilClosed();
  });
  Client first = connectTo(server);
  Client second = std::move(first);
  const std::vector<std::uint32_t> ids{3};
  EXPECT_EQ(second.describe(ids).at(0).name(), "Hall");
}

}  // namespace
}  // namespace enfilade::protocol
