#include "protocol/clients/cpp/async_client.hpp"

#include <gtest/gtest.h>

#include <optional>

#include "tests/protocol/test_server.hpp"

namespace enfilade::protocol {
namespace {

constexpr std::chrono::milliseconds kPatience{10'000};
constexpr int kMaxTurns = 10'000;

/// Advances until `done` holds or the connection is over.
template <typename Done>
bool runUntil(AsyncClient& client, const Done& done) {
  for (int i = 0; i < kMaxTurns && !done(); ++i) {
    if (!client.run(kPatience)) break;
  }
  return done();
}

v1::ClientMessage makeMetricsRequest() {
  v1::ClientMessage message;
  message.mutable_metrics();
  return message;
}

v1::ServerMessage makeMetricsReply(const v1::ClientMessage& request, std::uint64_t ticks) {
  v1::ServerMessage reply;
  reply.set_reply_to(request.request_id());
  reply.mutable_metrics()->set_ticks(ticks);
  return reply;
}

TEST(AsyncClient, GreetsWithoutBlockingAndReportsTheWelcomeFirst) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    connection.send(makeEvents(1));
    connection.waitUntilClosed();
  });
  std::vector<std::string> calls;
  AsyncHandlers handlers;
  handlers.welcome = [&](const v1::Welcome&) { calls.push_back("welcome"); };
  handlers.events = [&](const v1::TickEvents&) { calls.push_back("events"); };
  AsyncClient client("127.0.0.1", server.getPort(), handlers);
  EXPECT_TRUE(calls.empty()) << "no handler runs before advance()";
  EXPECT_TRUE(runUntil(client, [&] { return calls.size() == 2; }));
  EXPECT_EQ(calls, (std::vector<std::string>{"welcome", "events"}));
}

TEST(AsyncClient, RepliesReachTheirRequestersInOrder) {
  constexpr std::uint64_t kRequests = 100;
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    for (std::uint64_t i = 0; i < kRequests; ++i) {
      connection.send(makeMetricsReply(*connection.receive(), i));
      connection.send(makeEvents(i + 1));
    }
    connection.waitUntilClosed();
  });
  std::vector<std::uint64_t> ticks, sequences;
  AsyncHandlers handlers;
  handlers.events = [&](const v1::TickEvents& events) { sequences.push_back(events.sequence()); };
  AsyncClient client("127.0.0.1", server.getPort(), handlers);
  for (std::uint64_t i = 0; i < kRequests; ++i) {
    client.request(makeMetricsRequest(),
                   [&](const Reply& reply) { ticks.push_back(reply.message.metrics().ticks()); });
  }
  EXPECT_TRUE(runUntil(client, [&] { return sequences.size() == kRequests; }));
  ASSERT_EQ(ticks.size(), kRequests);
  for (std::uint64_t i = 0; i < kRequests; ++i) EXPECT_EQ(ticks[i], i);
  EXPECT_EQ(client.pendingRequests(), 0u);
}

TEST(AsyncClient, AFutureGetsTheReplyWithItsAttachment) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    const std::vector<std::uint8_t> pixels{1, 2, 3};
    connection.send(makeMetricsReply(*connection.receive(), 7), pixels);
    connection.waitUntilClosed();
  });
  AsyncClient client("127.0.0.1", server.getPort(), {});
  std::future<Reply> future = client.request(makeMetricsRequest());
  runUntil(client, [&] { return client.pendingRequests() == 0; });
  const Reply reply = future.get();
  EXPECT_EQ(reply.message.metrics().ticks(), 7u);
  EXPECT_EQ(reply.attachment, (std::vector<std::uint8_t>{1, 2, 3}));
  EXPECT_FALSE(reply.lost);
}

TEST(AsyncClient, AMissingServerIsReportedAndNotThrown) {
  std::uint16_t port = 0;
  {
    const TestServer server([](TestConnection&) {});
    port = server.getPort();
    AsyncClient knock("127.0.0.1", port, {});
    knock.run(kPatience);
  }
  std::optional<v1::Error> why;
  AsyncHandlers handlers;
  handlers.closed = [&](const v1::Error& error) { why = error; };
  AsyncClient client("127.0.0.1", port, handlers);
  EXPECT_TRUE(runUntil(client, [&] { return why.has_value(); }));
  EXPECT_NE(why->message().find("cannot connect to 127.0.0.1:"), std::string::npos)
      << why->message();
  EXPECT_EQ(client.descriptor(), -1);
}

TEST(AsyncClient, PendingRequestsAreReportedAsLostWhenTheConnectionEnds) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    connection.receive();
    v1::ServerMessage bye;
    bye.mutable_bye()->set_code(v1::ERROR_SHUTTING_DOWN);
    bye.mutable_bye()->set_reason("the server ends");
    connection.send(bye);
  });
  std::vector<std::string> calls;
  AsyncHandlers handlers;
  handlers.closed = [&](const v1::Error& why) {
    EXPECT_EQ(why.code(), v1::ERROR_SHUTTING_DOWN);
    EXPECT_NE(why.message().find("the server ends"), std::string::npos) << why.message();
    calls.push_back("closed");
  };
  AsyncClient client("127.0.0.1", server.getPort(), handlers);
  for (int i = 0; i < 2; ++i) {
    client.request(makeMetricsRequest(), [&](const Reply& reply) {
      EXPECT_TRUE(reply.lost);
      EXPECT_EQ(reply.message.error().code(), v1::ERROR_SHUTTING_DOWN);
      calls.push_back("lost");
    });
  }
  runUntil(client, [&] { return calls.size() == 3; });
  client.request(makeMetricsRequest(), [&](const Reply& reply) {
    EXPECT_TRUE(reply.lost);
    calls.push_back("late");
  });
  EXPECT_EQ(calls, (std::vector<std::string>{"lost", "lost", "closed", "late"}));
}

TEST(AsyncClient, MayBeDestroyedInAnyOfItsFunctions) {
  for (const std::string where : {"welcome", "events", "reply", "lost", "closed"}) {
    const TestServer server([](TestConnection& connection) {
      connection.greet();
      connection.send(makeMetricsReply(*connection.receive(), 1));
      connection.send(makeEvents(1));
      connection.receive();
    });
    std::optional<AsyncClient> client;
    int calls = 0;
    const auto destroyAt = [&](const std::string& here) {
      EXPECT_TRUE(client) << here << " was reported after" << where;
      ++calls;
      if (here == where) client.reset();
    };
    AsyncHandlers handlers;
    handlers.welcome = [&](const v1::Welcome&) { destroyAt("welcome"); };
    handlers.events = [&](const v1::TickEvents&) { destroyAt("events"); };
    handlers.closed = [&](const v1::Error&) { destroyAt("closed"); };
    client.emplace("127.0.0.1", server.getPort(), handlers);
    client->request(makeMetricsRequest(), [&](const Reply&) { destroyAt("reply"); });
    client->request(makeMetricsRequest(), [&](const Reply&) { destroyAt("lost"); });
    for (int i = 0; i < kMaxTurns && client && client->run(kPatience); ++i) {
    }
    EXPECT_FALSE(client) << where;
    EXPECT_GT(calls, 0);
  }
}

TEST(AsyncClient, DestructionBreaksFuturesAndCallsNoHandler) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    connection.waitUntilClosed();
  });
  std::future<Reply> future;
  {
    AsyncClient client("127.0.0.1", server.getPort(), {});
    future = client.request(makeMetricsRequest());
    client.request(makeMetricsRequest(), [](const Reply&) { ADD_FAILURE() << "it is gone"; });
  }
  EXPECT_THROW(future.get(), std::future_error);
}

TEST(AsyncClient, AcceptsALimitedNumberOfRequests) {
  const TestServer server([](TestConnection& connection) {
    connection.greet();
    connection.waitUntilClosed();
  });
  AsyncOptions options;
  options.maxPendingRequests = 4;  // the hello counts as one
  AsyncClient client("127.0.0.1", server.getPort(), {}, options);
  for (int i = 0; i < 3; ++i) client.request(makeMetricsRequest(), [](const Reply&) {});
  EXPECT_THROW(client.request(makeMetricsRequest(), [](const Reply&) {}), TooManyRequests);
}

TEST(AsyncClient, ReportsALostConnectionBeforeTheLimitOfUnsentRequests) {
  std::uint16_t gone = 0;
  {
    const TestServer server([](TestConnection&) {});
    gone = server.getPort();
  }
  std::optional<v1::Error> why;
  AsyncHandlers handlers;
  handlers.closed = [&](const v1::Error& error) { why = error; };
  AsyncOptions options;
  options.maxUnsentBytes = protocol::kMagic.size();  // so the hello alone exceeds it
  AsyncClient client("127.0.0.1", gone, handlers, options);
  ASSERT_TRUE(runUntil(client, [&] { return why.has_value(); }));
  bool lost = false;
  client.request(makeMetricsRequest(), [&](const Reply& reply) { lost = reply.lost; });
  EXPECT_TRUE(lost);
}

TEST(AsyncClient, RefusesAServerOfAnotherVersion) {
  const TestServer server([](TestConnection& connection) {
    v1::ServerMessage welcome = makeWelcomeTo(*connection.receive());
    welcome.mutable_welcome()->set_protocol_version("2.0.0");
    connection.sendRaw(std::string(kMagic.begin(), kMagic.end()));
    connection.send(welcome);
    connection.waitUntilClosed();
  });
  std::optional<v1::Error> why;
  AsyncHandlers handlers;
  handlers.welcome = [](const v1::Welcome&) { ADD_FAILURE(); };
  handlers.closed = [&](const v1::Error& error) { why = error; };
  AsyncClient client("127.0.0.1", server.getPort(), handlers);
  ASSERT_TRUE(runUntil(client, [&] { return why.has_value(); }));
  EXPECT_EQ(why->code(), v1::ERROR_VERSION);
}

TEST(AsyncClient, NoiseInTheAnswerEndsTheConnection) {
  const TestServer server([](TestConnection& connection) {
    connection.sendRaw("HTTP/1.1 400 Bad Request\r\n\r\n");
    connection.waitUntilClosed();
  });
  std::optional<v1::Error> why;
  AsyncHandlers handlers;
  handlers.closed = [&](const v1::Error& error) { why = error; };
  AsyncClient client("127.0.0.1", server.getPort(), handlers);
  ASSERT_TRUE(runUntil(client, [&] { return why.has_value(); }));
  EXPECT_NE(why->message().find("does not speak this protocol"), std::string::npos);
}

}  // namespace
}  // namespace enfilade::protocol
