// Tests of HTTP and WebSocket on the same port, and of streams that are neither.
#include "server/net/http_pages.hpp"
#include "tests/server/body_room.hpp"
#include "tests/server/raw_connection.hpp"
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

const std::string kHost = "Host: localhost\r\n";
const std::string kUpgrade =
    "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

/// A client's WebSocket message, masked by zeros: up to 125 bytes (RFC 6455, 5.2).
std::vector<std::uint8_t> makeWebSocketMessage(int opcode,
                                               const std::vector<std::uint8_t>& payload) {
  std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(0x80 | opcode),
                                  static_cast<std::uint8_t>(0x80 | payload.size()),
                                  0,
                                  0,
                                  0,
                                  0};
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

std::vector<std::uint8_t> makeHello() {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_hello()->set_protocol_version(protocol::kVersion);
  return protocol::encode(message);
}

class Http : public ServedRoom {
 protected:
  std::string sendRequest(const std::string& request) {
    RawConnection raw(server_->port());
    raw.send(request);
    return raw.readText();
  }
  std::string get(const std::string& target) {
    return sendRequest("GET " + target + " HTTP/1.1\r\n" + kHost + "\r\n");
  }
};

TEST_F(Http, HealthIsOkAndUnknownPagesAreNamed) {
  serve();
  EXPECT_NE(get("/healthz").find("\r\n\r\nok\n"), std::string::npos);
  EXPECT_EQ(get("/secrets").substr(0, 12), "HTTP/1.1 404");
  EXPECT_EQ(sendRequest("POST /metrics HTTP/1.1\r\n" + kHost + "\r\n").substr(0, 12),
            "HTTP/1.1 405");
  EXPECT_EQ(sendRequest("GET  nonsense\r\n\r\n").substr(0, 12), "HTTP/1.1 400");
  EXPECT_EQ(
      sendRequest("GET / HTTP/1.1\r\nX: " + std::string(20'000, 'x') + "\r\n\r\n").substr(0, 12),
      "HTTP/1.1 431");
}

TEST_F(Http, MethodsSchemesAndHostsFollowTheStandards) {
  Access access;
  access.tokens = {{Role::observe, "0123456789abcdef"}};
  access.hosts = {"Model.Example.org"};
  serve({}, makeSmallRoom(), access);
  const std::string post =
      sendRequest("POST /healthz HTTP/1.1\r\n" + kHost + "Content-Length: 3\r\n\r\nabc");
  EXPECT_EQ(post.substr(0, 12), "HTTP/1.1 405");
  EXPECT_NE(post.find("\r\nAllow: GET, HEAD\r\n"), std::string::npos) << post;
  const std::string head = sendRequest("HEAD /healthz HTTP/1.1\r\n" + kHost + "\r\n");
  EXPECT_EQ(head.substr(0, 12), "HTTP/1.1 200");
  EXPECT_NE(head.find("Content-Length: 3\r\n"), std::string::npos) << head;
  EXPECT_TRUE(head.ends_with("\r\n\r\n")) << "no body: " << head;
  const auto metrics = [&](const std::string& headers) {
    return sendRequest("GET /metrics HTTP/1.1\r\n" + headers + "\r\n").substr(9, 3);
  };
  EXPECT_EQ(metrics(kHost + "Authorization: bearer 0123456789abcdef\r\n"), "200");
  EXPECT_EQ(metrics(kHost + "Authorization: Basic 0123456789abcdef\r\n"), "401");
  EXPECT_EQ(metrics("Host: MODEL.example.ORG\r\nAuthorization: Bearer 0123456789abcdef\r\n"),
            "200");
  EXPECT_EQ(metrics(kHost + "Host: evil.example.com\r\n"), "400");
  EXPECT_EQ(metrics(kHost + "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: no-cors\r\n"), "403");
}

TEST_F(Http, AWebSocketsKeyHasSixteenBytes) {
  serve();
  const std::string shortKey =
      "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: short\r\n";
  EXPECT_EQ(sendRequest("GET / HTTP/1.1\r\n" + kHost + shortKey + "\r\n").substr(0, 12),
            "HTTP/1.1 400");
}

TEST_F(Http, AFullServerAnswersHealthChecksAndNoOneElse) {
  ServerLimits limits;
  limits.connections = 2;
  limits.reservedConnections = 4;
  serve(limits);
  const protocol::Client one = makeClient("one"), two = makeClient("two");
  for (int round = 0; round < 3; ++round) {
    EXPECT_EQ(get("/healthz").substr(0, 12), "HTTP/1.1 200");
    EXPECT_EQ(get("/metrics").substr(0, 12), "HTTP/1.1 200");
    EXPECT_EQ(get("/scene.glb").substr(0, 12), "HTTP/1.1 503");
    RawConnection silent(server_->port());
    RawConnection socket(server_->port());
    socket.send("GET / HTTP/1.1\r\n" + kHost + kUpgrade + "\r\n");
    EXPECT_EQ(socket.readText().substr(0, 12), "HTTP/1.1 503") << "not a WebSocket";
    RawConnection client(server_->port());
    client.sendHello();
    EXPECT_EQ(client.readToEnd().bye.code(), v1::ERROR_NOT_ALLOWED);
  }
}

TEST_F(Http, AStreamWithoutAvatarEndsAndStreamsAreLimited) {
  ServerLimits limits;
  limits.streams = 1;
  limits.streamTimeout = std::chrono::milliseconds(300);
  serve(limits);
  ENFILADE_NEED_PICTURES(*server_);
  RawConnection first(server_->port());
  first.send("GET /mjpeg/avatar/nemo HTTP/1.1\r\n" + kHost + "\r\n");
  std::string second;
  // The first stream counts once its world has answered.
  while ((second = get("/mjpeg/avatar/nemo").substr(9, 3)) == "404") {
  }
  EXPECT_EQ(second, "503");
  EXPECT_EQ(first.readText().substr(0, 12), "HTTP/1.1 404");
}

TEST_F(Http, TheLastPictureIsSentAgain) {
  ServerLimits limits;
  limits.repeatDelay = std::chrono::milliseconds(50);
  serve(limits);
  ENFILADE_NEED_PICTURES(*server_);
  RawConnection raw(server_->port());
  raw.send("GET /mjpeg/camera?eye=0,1,0&target=5,1,0&width=32&height=24&rate=0 HTTP/1.1\r\n" +
           kHost + "\r\n");
  EXPECT_NE(raw.readText("X-Tick: 0").find("X-Tick: 0"), std::string::npos);
  EXPECT_NE(raw.readText("X-Tick: 0").find("X-Tick: 0"), std::string::npos);
  makeClient("other").step();
  EXPECT_NE(raw.readText("X-Tick: 1").find("X-Tick: 1"), std::string::npos);
}

TEST_F(Http, MetricsContainTheTicks) {
  serve();
  protocol::Client other = makeClient("other");
  other.step(7);
  const std::string page = get("/metrics");
  EXPECT_NE(page.find("text/plain; version=0.0.4"), std::string::npos);
  EXPECT_NE(page.find("\nenfilade_ticks_total{world=\"main\"} 7\n"), std::string::npos) << page;
  EXPECT_NE(page.find("\nenfilade_clients{world=\"main\"} 1\n"), std::string::npos);
  EXPECT_NE(
      page.find("enfilade_stage_microseconds{world=\"main\",stage=\"tick\",quantile=\"0.5\"} "),
      std::string::npos);
}

TEST_F(Http, MetricsContainTheWorkOfTheTicks) {
  constexpr std::uint32_t kTicks = 40;
  serve({}, makeBodyRoom());
  protocol::Client ann = makeClient("ann");
  ASSERT_FALSE(ann.command(spawn("ann", 3.5, 0.01, 0)));
  ASSERT_FALSE(ann.command(walkTo("ann", 5.5, 0, 0)));
  const v1::StepReply stepped = ann.step(kTicks, true);
  ASSERT_EQ(stepped.avatars_size(), 1);
  const std::uint32_t id = stepped.avatars(0).id();
  const v1::Metrics metrics = ann.metrics();
  EXPECT_GT(metrics.vertices_looked_at(), 0u);
  EXPECT_GT(metrics.parts_looked_at(), 0u);
  ASSERT_EQ(metrics.avatar_work_size(), 1);
  EXPECT_EQ(metrics.avatar_work(0).id(), id);
  EXPECT_EQ(metrics.avatar_work(0).tick(), kTicks);
  EXPECT_GT(metrics.avatar_work(0).narrow_queries(), 0u);
  EXPECT_EQ(metrics.avatar_work(0).position().x(), stepped.avatars(0).feet().x());
  const v1::AvatarWork& costliest = metrics.costliest_avatar();
  EXPECT_EQ(costliest.id(), id);
  EXPECT_GE(costliest.narrow_queries(), metrics.avatar_work(0).narrow_queries());
  const std::string page = get("/metrics");
  const auto expectLine = [&](const std::string& name, std::uint64_t value) {
    const std::string line =
        "\nenfilade_" + name + "{world=\"main\"} " + std::to_string(value) + "\n";
    EXPECT_NE(page.find(line), std::string::npos) << line << page;
  };
  expectLine("vertices_looked_at_total", metrics.vertices_looked_at());
  expectLine("part_boxes_made_total", metrics.part_boxes_made());
  expectLine("parts_looked_at_total", metrics.parts_looked_at());
  expectLine("costliest_avatar_queries", costliest.narrow_queries());
}

TEST_F(Http, ForeignPagesAreRefused) {
  serve();
  const std::string upgrade = "GET / HTTP/1.1\r\n" + kUpgrade;
  EXPECT_EQ(sendRequest(upgrade + kHost + "Origin: https://evil.example.com\r\n\r\n").substr(0, 12),
            "HTTP/1.1 403");
  EXPECT_EQ(sendRequest(upgrade + "Host: rebound.example.com\r\n\r\n").substr(0, 12),
            "HTTP/1.1 403");
  EXPECT_EQ(sendRequest("GET /metrics HTTP/1.1\r\n\r\n").substr(0, 12), "HTTP/1.1 403");
}

TEST_F(Http, AWebSocketSpeaksTheProtocol) {
  serve();
  RawConnection raw(server_->port());
  raw.send("GET / HTTP/1.1\r\n" + kHost + "Origin: http://localhost\r\n" + kUpgrade + "\r\n");
  const std::string head = raw.readText("\r\n\r\n");
  EXPECT_EQ(head.substr(0, 12), "HTTP/1.1 101");
  EXPECT_NE(head.find("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="), std::string::npos) << "RFC 6455, 1.3";
  raw.send(makeWebSocketMessage(2, makeHello()));
  EXPECT_NE(raw.readText("small_room").find("small_room"), std::string::npos);
  raw.send(makeWebSocketMessage(8, {}));
  EXPECT_NE(raw.readText().find('\x88'), std::string::npos) << "closed in return";
}

TEST_F(Http, TextInAWebSocketAndTooLongMessagesEndIt) {
  serve();
  for (const auto& bytes :
       {makeWebSocketMessage(1, makeHello()),
        std::vector<std::uint8_t>{0x82, 0xFF, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0}}) {
    RawConnection raw(server_->port());
    raw.send("GET / HTTP/1.1\r\n" + kHost + kUpgrade + "\r\n");
    raw.readText("\r\n\r\n");
    raw.send(bytes);
    const std::string answer = raw.readText("small_room");
    EXPECT_EQ(answer.find("small_room"), std::string::npos);
    const bool isText = bytes[0] == 0x81;
    EXPECT_EQ(answer.find("\x03\xEBonly binary messages") != std::string::npos, isText)
        << "code 1003";
  }
  EXPECT_EQ(makeClient("other").step().tick(), 1u);
}

TEST_F(Http, ASlowRequestTimesOut) {
  ServerLimits limits;
  limits.helloTimeout = std::chrono::milliseconds(50);
  serve(limits);
  EXPECT_EQ(sendRequest("GET /healthz HTTP/1.1\r\nX-Slow: ").substr(0, 12), "HTTP/1.1 408");
  RawConnection never(server_->port());
  never.send("GE");
  EXPECT_EQ(never.readToEnd().error.code(), v1::ERROR_BAD_MESSAGE);
  RawConnection quiet(server_->port());
  quiet.send("GET / HTTP/1.1\r\n" + kHost + kUpgrade + "\r\n");
  EXPECT_NE(quiet.readText().find("no complete hello before the deadline"), std::string::npos);
}

TEST_F(Http, ATlsGreetingGetsAnError) {
  serve();
  RawConnection raw(server_->port());
  raw.send(std::vector<std::uint8_t>{0x16, 0x03, 0x01, 0x02, 0x00, 0x01, 0x00, 0x01, 0xFC});
  const v1::Error error = raw.readToEnd().error;
  EXPECT_EQ(error.code(), v1::ERROR_BAD_MESSAGE);
  EXPECT_NE(error.message().find("TLS"), std::string::npos) << error.message();
}

TEST_F(Http, PicturesFlowAsTheWorldMoves) {
  serve();
  ENFILADE_NEED_PICTURES(*server_);
  protocol::Client other = makeClient("other");
  RawConnection raw(server_->port());
  raw.send("GET /mjpeg/camera?eye=0,1,0&target=5,1,0&width=32&height=24&rate=0 HTTP/1.1\r\n" +
           kHost + "\r\n");
  const std::string first = raw.readText("\xFF\xD8\xFF");
  EXPECT_NE(first.find("multipart/x-mixed-replace"), std::string::npos);
  EXPECT_NE(first.find("X-Tick: 0"), std::string::npos);
  EXPECT_NE(first.find("\xFF\xD8\xFF"), std::string::npos) << "a JPEG begins";
  other.step();
  EXPECT_NE(raw.readText("X-Tick: 1").find("X-Tick: 1"), std::string::npos);
  EXPECT_EQ(get("/mjpeg/camera?eye=0,1&target=5,1,0").substr(0, 12), "HTTP/1.1 400");
  EXPECT_EQ(get("/mjpeg/camera?eye=0,1,0&target=5,1,0&width=9999").substr(0, 12), "HTTP/1.1 400");
}

TEST_F(Http, TheEndOfTheServerEndsItsVisits) {
  ServerLimits limits;
  limits.closeTimeout = std::chrono::milliseconds(100);
  serve(limits);
  RawConnection raw(server_->port());
  raw.send("GET / HTTP/1.1\r\n" + kHost + kUpgrade + "\r\n");
  raw.readText("\r\n\r\n");
  raw.send(makeWebSocketMessage(2, makeHello()));
  raw.readText("small_room");
  server_->stop();
  EXPECT_NE(raw.readText().find("the server is stopping"), std::string::npos);
}

TEST(HttpPages, MetricsHaveALineForEachCounterOfWork) {
  WorldMetrics hall{"hall", {}};
  hall.metrics.set_narrow_queries(101);
  hall.metrics.set_vertices_looked_at(102);
  hall.metrics.set_part_boxes_made(103);
  hall.metrics.set_parts_looked_at(104);
  hall.metrics.mutable_costliest_avatar()->set_narrow_queries(105);
  hall.metrics.mutable_costliest_avatar()->set_parts_looked_at(106);
  const std::vector<WorldMetrics> worlds{hall, {"empty", {}}};
  const std::string page = makeMetricsPage(worlds);
  for (const char* line :
       {"narrow_queries_total{world=\"hall\"} 101", "vertices_looked_at_total{world=\"hall\"} 102",
        "part_boxes_made_total{world=\"hall\"} 103", "parts_looked_at_total{world=\"hall\"} 104",
        "costliest_avatar_queries{world=\"hall\"} 105",
        "costliest_avatar_queries{world=\"empty\"} 0"})
    EXPECT_NE(page.find(std::string("\nenfilade_") + line + "\n"), std::string::npos) << line;
}

TEST(HttpPages, TargetsAreParsed) {
  const Target target = parseTarget("/mjpeg/avatar/a%2Eb?width=3&x=%zz&flag");
  EXPECT_EQ(target.path, "/mjpeg/avatar/a.b");
  EXPECT_EQ(target.query.at("width"), "3");
  EXPECT_EQ(target.query.at("x"), "%zz");
  EXPECT_EQ(target.query.at("flag"), "");
}

}  // namespace
}  // namespace enfilade::server::testing
