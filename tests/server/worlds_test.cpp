// Tests of several worlds in one server: create, enter, distinguish, delete.
#include "server/worlds/world_registry.hpp"

#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <fstream>
#include <future>
#include <numbers>
#include <thread>

#include "server/net/listener.hpp"
#include "tests/server/eventually.hpp"
#include "tests/server/raw_connection.hpp"
#include "tests/server/served_room.hpp"
#include "tests/support/sanitized.hpp"

namespace enfilade::server::testing {
namespace {

class HostedWorlds : public ServedRoom {
 protected:
  protocol::Client makeClientIn(const std::string& world, const std::string& name = "ann") {
    return makeClient(name, "", world);
  }
};

/// The error of a request; ERROR_UNSPECIFIED if it succeeded.
v1::ErrorCode catchCode(const std::function<void()>& request) {
  try {
    request();
  } catch (const protocol::ProtocolError& error) {
    return error.code;
  }
  return v1::ERROR_UNSPECIFIED;
}

v1::World create(protocol::Client& by, const std::string& name, const std::string& scene = "",
                 bool dropWhenEmpty = false) {
  v1::ClientMessage message;
  message.mutable_create_world()->set_name(name);
  message.mutable_create_world()->set_scene(scene);
  message.mutable_create_world()->set_drop_when_empty(dropWhenEmpty);
  return by.request(std::move(message)).create_world().world();
}

void drop(protocol::Client& by, const std::string& name) {
  v1::ClientMessage message;
  message.mutable_drop_world()->set_name(name);
  by.request(std::move(message));
}

std::vector<v1::World> list(protocol::Client& by) {
  v1::ClientMessage message;
  message.mutable_list_worlds();
  const v1::WorldList worlds = by.request(std::move(message)).worlds();
  return {worlds.worlds().begin(), worlds.worlds().end()};
}

std::vector<std::string> getNames(const std::vector<v1::World>& worlds) {
  std::vector<std::string> names;
  for (const v1::World& world : worlds) names.push_back(world.name());
  return names;
}

/// The state hashes of a walk to the wall.
std::vector<std::uint64_t> collectWalkHashes(protocol::Client& walker) {
  EXPECT_FALSE(walker.command(spawn("ann", 0, 0.001, 0)));
  EXPECT_FALSE(walker.command(walkTo("ann", 8, 0, 1)));
  std::vector<std::uint64_t> hashes;
  for (int i = 0; i < 300; ++i) hashes.push_back(walker.step().state_hash());
  return hashes;
}

v1::SetClock makeFreeRun(double speed) {
  v1::SetClock clock;
  clock.mutable_free_run()->set_speed(speed);
  return clock;
}

/// The Bye of a client that waits in a world.
v1::Bye awaitBye(protocol::Client& client) {
  while (const auto event = client.nextEvent(std::chrono::seconds(20)))
    if (event->has_bye()) return event->bye();
  return {};
}

TEST_F(HostedWorlds, TheSameCommandsGiveTheSameBitsWhateverHappensInOtherWorlds) {
  serve();
  protocol::Client main = makeClient("main");
  create(main, "calm");
  create(main, "busy");
  constexpr int kCrowd = 15;
  protocol::Client crowd = makeClientIn("busy", "crowd");
  for (int i = 0; i < kCrowd; ++i)
    ASSERT_FALSE(crowd.command(spawn("a" + std::to_string(i), -9 + 0.9 * i, 0.001, 3)));
  for (int i = 0; i < kCrowd; ++i)
    ASSERT_FALSE(crowd.command(walkTo("a" + std::to_string(i), 9 - 0.9 * i, 0, -3)));
  crowd.setClock(makeFreeRun(1000));
  protocol::Client calm = makeClientIn("calm");
  EXPECT_EQ(collectWalkHashes(main), collectWalkHashes(calm));
  EXPECT_GT(crowd.metrics().ticks(), 0u);
  EXPECT_EQ(calm.metrics().avatars(), 1u);
  EXPECT_EQ(crowd.metrics().avatars(), kCrowd + 0u);
}

TEST_F(HostedWorlds, EachIsListedWithItsOwnTicksAndClients) {
  serve();
  protocol::Client main = makeClient("main");
  EXPECT_EQ(main.welcome().world(), "main");
  ASSERT_EQ(main.welcome().scenes_size(), 1);
  EXPECT_EQ(main.welcome().scenes(0), "small_room");
  EXPECT_EQ(create(main, "b").scene(), "small_room");
  const std::string chosen = create(main, "").name();
  protocol::Client bob = makeClientIn("b", "bob");
  EXPECT_EQ(bob.welcome().world(), "b");
  EXPECT_FALSE(bob.welcome().clock().has_driver()) << "each has a driver of its own";
  main.step(5);
  bob.step(7);
  const std::vector<v1::World> worlds = list(main);
  EXPECT_EQ(getNames(worlds), (std::vector<std::string>{"main", "b", chosen}));
  EXPECT_EQ(worlds[0].tick(), 5u);
  EXPECT_EQ(worlds[1].tick(), 7u);
  EXPECT_EQ(worlds[2].tick(), 0u);
  EXPECT_EQ(worlds[1].clients(), 1u);
  EXPECT_EQ(worlds[2].clients(), 0u);
  EXPECT_TRUE(worlds[1].clock().has_driver());
}

TEST_F(HostedWorlds, NamesAreValidated) {
  ServerLimits limits;
  limits.worlds = 3;
  serve(limits);
  protocol::Client ann = makeClient("ann");
  EXPECT_EQ(ann.welcome().limits().max_worlds(), 3u);
  for (const char* bad : {"a b", "../a", ".a", "a/b", "\xc3\xa9"})
    EXPECT_EQ(catchCode([&] { create(ann, bad); }), v1::ERROR_BAD_MESSAGE) << bad;
  EXPECT_EQ(catchCode([&] { create(ann, std::string(65, 'a')); }), v1::ERROR_BAD_MESSAGE);
  EXPECT_EQ(catchCode([&] { create(ann, "b", "cathedral"); }), v1::ERROR_UNKNOWN_WORLD);
  EXPECT_EQ(catchCode([&] { create(ann, "main"); }), v1::ERROR_NOT_ALLOWED);
  create(ann, "b");
  EXPECT_EQ(catchCode([&] { create(ann, "b"); }), v1::ERROR_NOT_ALLOWED);
  create(ann, "c");
  EXPECT_EQ(catchCode([&] { create(ann, "d"); }), v1::ERROR_TOO_LARGE);
  EXPECT_EQ(catchCode([&] { drop(ann, "d"); }), v1::ERROR_UNKNOWN_WORLD);
  EXPECT_EQ(catchCode([&] { drop(ann, "main"); }), v1::ERROR_NOT_ALLOWED);
  EXPECT_EQ(catchCode([&] { makeClientIn("d"); }), v1::ERROR_UNKNOWN_WORLD);
}

TEST_F(HostedWorlds, OnlyAnAdminMakesAndDropsThem) {
  Access access;
  access.tokens = {{Role::drive, "driver-0123456789"}, {Role::admin, "admin-0123456789"}};
  serve({}, makeSmallRoom(), access);
  protocol::Client driver = makeClient("driver", "driver-0123456789");
  protocol::Client admin = makeClient("admin", "admin-0123456789");
  EXPECT_EQ(catchCode([&] { create(driver, "b"); }), v1::ERROR_NOT_ALLOWED);
  create(admin, "b");
  EXPECT_EQ(catchCode([&] { drop(driver, "b"); }), v1::ERROR_NOT_ALLOWED);
  EXPECT_EQ(list(driver).size(), 2u);
  EXPECT_EQ(makeClient("in b", "driver-0123456789", "b").welcome().role(), v1::ROLE_DRIVE);
  drop(admin, "b");
}

TEST_F(HostedWorlds, ClientsOfADroppedWorldAreNotifiedAndTheirContactsEnd) {
  serve();
  protocol::Client main = makeClient("main");
  create(main, "b");
  protocol::Client bob = makeClientIn("b");
  bob.subscribe(makeFullSubscription());
  ASSERT_FALSE(bob.command(spawn("bob", 0, 0.001, 0)));
  bob.step(10);
  drop(main, "b");
  ReceivedEvents received;
  v1::Bye bye;
  while (const auto event = bob.nextEvent(std::chrono::seconds(20))) {
    if (event->has_bye()) {
      bye = event->bye();
      break;
    }
    received.add({*event});
  }
  EXPECT_EQ(bye.code(), v1::ERROR_WORLD_DROPPED);
  EXPECT_EQ(bye.reason(), "the world 'b' was dropped");
  EXPECT_EQ(received.count(v1::ContactEvent::KIND_END), 1u);
  EXPECT_EQ(main.step().tick(), 1u) << "the others go on";
  EXPECT_EQ(catchCode([&] { makeClientIn("b"); }), v1::ERROR_UNKNOWN_WORLD);
  EXPECT_EQ(create(main, "b").tick(), 0u) << "the name is free";
}

TEST_F(HostedWorlds, OneIsDroppedUnderAWaitingStep) {
  serve();
  protocol::Client main = makeClient("main");
  create(main, "b");
  protocol::Client bob = makeClientIn("b");
  ASSERT_FALSE(bob.command(spawn("bob", 0, 0.001, 0)));
  bob.step(1);
  auto stepping = std::async(std::launch::async, [&] {
    return catchCode([&] {
      for (;;) bob.step(36'000);
    });
  });
  ASSERT_TRUE(becomesTrue([&] { return list(main)[1].tick() > 10; }));
  drop(main, "b");
  EXPECT_EQ(stepping.get(), v1::ERROR_WORLD_DROPPED);
}

TEST_F(HostedWorlds, OneIsDroppedWhileItsPicturesAreDrawn) {
  serve();
  ENFILADE_NEED_PICTURES(*server_);
  protocol::Client main = makeClient("main");
  v1::FrameRequest request;
  *request.mutable_free()->mutable_eye() = makeVec(0, 1, 0);
  *request.mutable_free()->mutable_forward() = makeVec(1, 0, 0);
  request.set_width(1000);
  request.set_height(1000);
  for (int round = 0; round < 5; ++round) {
    create(main, "b");
    RawConnection bob(server_->port());
    bob.sendMagic();
    v1::ClientMessage message;
    message.set_request_id(1);
    message.mutable_hello()->set_protocol_version(protocol::kVersion);
    message.mutable_hello()->set_world("b");
    bob.send(message);
    for (std::uint64_t id = 2; id < 6; ++id) {
      message.set_request_id(id);
      *message.mutable_frame() = request;
      bob.send(message);
    }
    ASSERT_TRUE(bob.receive().value().has_welcome());
    drop(main, "b");
    std::vector<std::uint64_t> answered;
    std::optional<v1::ServerMessage> received;
    while ((received = bob.receive()) && !received->has_bye())
      answered.push_back(received->reply_to());
    ASSERT_TRUE(received) << "no last words";
    EXPECT_EQ(received->bye().code(), v1::ERROR_WORLD_DROPPED);
    // Each once and in order; the last request that the service took may be lost with the
    // connection.
    for (std::size_t i = 0; i + 1 < answered.size(); ++i) EXPECT_LT(answered[i], answered[i + 1]);
    EXPECT_EQ(main.frame(request).description.width(), 1000u);
  }
}

TEST_F(HostedWorlds, AClientThatDropsItsOwnWorldGetsTheReplyFirst) {
  serve();
  protocol::Client main = makeClient("main");
  create(main, "b");
  protocol::Client bob = makeClientIn("b");
  drop(bob, "b");
  EXPECT_EQ(awaitBye(bob).code(), v1::ERROR_WORLD_DROPPED);
  EXPECT_EQ(list(main).size(), 1u);
}

TEST_F(HostedWorlds, ADropWhenEmptyWorldEndsWithItsLastClient) {
  serve();
  protocol::Client main = makeClient("main");
  EXPECT_TRUE(create(main, "b", "", true).drop_when_empty());
  RawConnection http(server_->port());
  http.send("GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_NE(http.readText().find("{world=\"b\"}"), std::string::npos);
  EXPECT_EQ(list(main).size(), 2u) << "no client has entered it yet";
  {
    protocol::Client first = makeClientIn("b"), second = makeClientIn("b");
    { const protocol::Client leaves = std::move(first); }
    ASSERT_TRUE(becomesTrue([&] { return list(main)[1].clients() == 1; }));
    EXPECT_EQ(second.step().tick(), 1u);
  }
  EXPECT_TRUE(becomesTrue([&] { return list(main).size() == 1; }));
}

TEST_F(HostedWorlds, AnUnusedWorldIsDroppedAfterAWhile) {
  ServerLimits limits;
  limits.emptyWorldTimeout = std::chrono::milliseconds(300);
  serve(limits);
  protocol::Client main = makeClient("main");
  create(main, "stays");
  create(main, "entered", "", true);
  const protocol::Client inside = makeClientIn("entered");
  create(main, "forgotten", "", true);
  EXPECT_EQ(list(main).size(), 4u);
  ASSERT_TRUE(becomesTrue([&] { return list(main).size() == 3; }));
  for (const v1::World& world : list(main)) EXPECT_NE(world.name(), "forgotten");
}

TEST_F(HostedWorlds, AClientThatDisconnectsWhileUnreadIsNoticed) {
  ServerLimits limits;
  limits.pendingRequests = 4;
  limits.ticksPerStep = 1'000'000'000;  // days
  serve(limits);
  protocol::Client watch = makeClient("watch");
  create(watch, "b");
  {
    RawConnection bob(server_->port());
    bob.sendMagic();
    v1::ClientMessage message;
    message.set_request_id(1);
    message.mutable_hello()->set_protocol_version("1.0.0");
    message.mutable_hello()->set_world("b");
    bob.send(message);
    ASSERT_TRUE(bob.receive().value().has_welcome());
    message.set_request_id(2);
    message.mutable_step()->set_ticks(limits.ticksPerStep);
    bob.send(message);
    for (std::uint64_t id = 3; id < 20; ++id) {
      message.set_request_id(id);
      message.mutable_metrics();
      bob.send(message);
    }
    ASSERT_TRUE(becomesTrue([&] { return list(watch)[1].tick() > 10; }));
  }
  EXPECT_TRUE(becomesTrue([&] { return list(watch)[1].clients() == 0; }));
}

/// A hall 100 m wide with the requested number of posts.
std::shared_ptr<const scene::Scene> makeHall(std::size_t posts) {
  scene::Model model = makeSmallRoom()->model();
  model.source = "halls/hall.glb";
  for (std::size_t i = 0; i < posts; ++i) {
    scene::Object post = model.objects[kColumn - 1];
    post.path = "post" + std::to_string(i);
    post.worldFromMesh = Eigen::Affine3d(Eigen::Translation3d(
        20 + 0.7 * static_cast<double>(i % 300), 0, 20 + 0.7 * static_cast<double>(i / 300)));
    model.objects.push_back(std::move(post));
  }
  return std::make_shared<const scene::Scene>(std::move(model));
}

TEST_F(HostedWorlds, ScenesThatAServerBeginsWithHaveAWorldEach) {
  ServerOptions options;
  options.additionalScenes = {makeHall(4), makeHall(5), makeSmallRoom()};
  server_ = std::make_unique<Server>(makeSmallRoom(), HostPort{"127.0.0.1", 0}, std::move(options));
  EXPECT_EQ(server_->worldNames(),
            (std::vector<std::string>{"main", "hall", "hall-2", "small_room-2"}));
  protocol::Client main = makeClient("main");
  EXPECT_EQ(main.welcome().scene().objects(), 3u);
  EXPECT_EQ(main.welcome().scenes(1), "hall");
  EXPECT_EQ(makeClientIn("hall").welcome().scene().objects(), 7u);
  EXPECT_EQ(makeClientIn("hall-2").welcome().scene().objects(), 8u);
  create(main, "more", "hall-2");
  EXPECT_EQ(makeClientIn("more").welcome().scene().objects(), 8u);
  protocol::Client inHall = makeClientIn("hall");
  EXPECT_EQ(create(inHall, "own").scene(), "hall") << "its own where none is named";
}

TEST_F(HostedWorlds, MetricsAndHealthCoverAllOfThem) {
  serve();
  protocol::Client main = makeClient("main");
  create(main, "b");
  protocol::Client bob = makeClientIn("b");
  main.step(3);
  bob.step(4);
  const auto get = [&](const std::string& target) {
    RawConnection raw(server_->port());
    raw.send("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
    return raw.readText();
  };
  const std::string page = get("/metrics"), alone = get("/metrics?world=b");
  EXPECT_NE(page.find("\nenfilade_ticks_total{world=\"main\"} 3\n"), std::string::npos) << page;
  EXPECT_NE(page.find("\nenfilade_ticks_total{world=\"b\"} 4\n"), std::string::npos);
  EXPECT_EQ(alone.find("main"), std::string::npos);
  EXPECT_NE(alone.find("{world=\"b\"} 4\n"), std::string::npos);
  EXPECT_NE(get("/healthz").find("\r\n\r\nok\n"), std::string::npos);
  EXPECT_EQ(get("/metrics?world=c").substr(0, 12), "HTTP/1.1 404");
  EXPECT_EQ(get("/mjpeg/avatar/ann?world=c").substr(0, 12), "HTTP/1.1 404");
}

TEST(Listening, AClientThatConnectsDuringTheShutdownIsNotified) {
  boost::asio::io_context context{1};
  WorldRegistry worlds({makeSmallRoom()}, {}, {});
  Listener listener(context, {"127.0.0.1", 0}, worlds, {}, {}, {});
  listener.start();
  std::thread network([&] { context.run(); });
  worlds.stop();
  const v1::ErrorCode code =
      catchCode([&] { protocol::Client("127.0.0.1", listener.port(), protocol::ClientOptions{}); });
  EXPECT_EQ(code, v1::ERROR_SHUTTING_DOWN);
  boost::asio::post(context, [&] { listener.stop(); });
  network.join();
  worlds.finishServices();
}

// ---- without sockets ----------------------------------------------------------------------------

/// The result of a request for a world.
std::variant<v1::World, v1::Error> createWorld(WorldRegistry& worlds, const std::string& name) {
  std::promise<std::variant<v1::World, v1::Error>> promise;
  worlds.create({name, "small_room", false}, [&](auto world) { promise.set_value(world); });
  return promise.get_future().get();
}

std::optional<v1::Error> dropWorld(WorldRegistry& worlds, const std::string& name) {
  std::promise<std::optional<v1::Error>> promise;
  worlds.drop(name, "main", [&](auto problem) { promise.set_value(problem); });
  return promise.get_future().get();
}

TEST(WorldRegistry, AFailedWorldIsReportedAndTheOthersContinue) {
  WorldRegistry worlds({makeSmallRoom()}, {}, {});
  ASSERT_TRUE(std::holds_alternative<v1::World>(createWorld(worlds, "b")));
  const auto world = worlds.find("b");
  const auto out = std::make_shared<OutgoingQueue>(OutgoingLimits{1u << 20, 2}, Buffer(), [] {});
  ASSERT_NE(world->join("bob", Role::admin, out, 1), 0u);
  world->post([](HostedWorld&) { throw std::runtime_error("the roof came down"); });
  ASSERT_TRUE(becomesTrue([&] { return world->failure() && out->finished(); }));
  EXPECT_EQ(worlds.makeWorldList().worlds(1).failure(), "the roof came down");
  EXPECT_EQ(world->join("late", Role::admin, out, 1), 0u) << "no client can enter it";
  EXPECT_FALSE(worlds.mainWorld().failure());
  EXPECT_TRUE(worlds.mainWorld().post([](HostedWorld&) {}));
  EXPECT_FALSE(dropWorld(worlds, "b"));
  EXPECT_EQ(worlds.allWorlds().size(), 1u);
}

TEST(WorldRegistry, RequestsAfterTheEndAreRefused) {
  WorldRegistry worlds({makeSmallRoom()}, {}, {});
  worlds.stop();
  EXPECT_EQ(std::get<v1::Error>(createWorld(worlds, "b")).code(), v1::ERROR_SHUTTING_DOWN);
  EXPECT_EQ(dropWorld(worlds, "b")->code(), v1::ERROR_SHUTTING_DOWN);
}

/// Resident memory that only this process uses, in bytes.
std::size_t readResidentBytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

constexpr std::size_t kMiB = 1u << 20;

TEST(WorldRegistry, AllAreCreatedAndDroppedRepeatedlyInConstantMemory) {
  const std::uint32_t maxWorlds = ServerLimits().worlds;
  WorldRegistry worlds({makeSmallRoom()}, {}, {});
  std::vector<std::size_t> after;
  for (int round = 0; round < 8; ++round) {
    for (std::uint32_t i = 1; i < maxWorlds; ++i)
      ASSERT_TRUE(std::holds_alternative<v1::World>(createWorld(worlds, "w" + std::to_string(i))));
    EXPECT_EQ(worlds.allWorlds().size(), maxWorlds);
    EXPECT_EQ(std::get<v1::Error>(createWorld(worlds, "one-more")).code(), v1::ERROR_TOO_LARGE);
    for (std::uint32_t i = 1; i < maxWorlds; ++i)
      ASSERT_FALSE(dropWorld(worlds, "w" + std::to_string(i)));
    after.push_back(readResidentBytes());
  }
  EXPECT_EQ(worlds.allWorlds().size(), 1u);
  if (!tests::kSanitized) {
    EXPECT_LT(after.back(), after[3] + 4 * kMiB);
  }
}

/// The scene's meshes, parts and names are shared, so they do not count.
TEST(WorldRegistry, AnotherWorldOfASceneAddsOnlyBoxesOfStaticObjects) {
  constexpr std::size_t kPosts = 30'000, kMaxBytesPerBox = 100, kWorlds = 20;
  const auto before = readResidentBytes();
  const auto scene = makeHall(kPosts);
  WorldRegistry worlds({scene}, {}, {});
  static_cast<void>(worlds.rendererName());  // waits for the renderer, which allocates memory, too
  const auto one = readResidentBytes();
  for (std::size_t i = 0; i < kWorlds; ++i) {
    std::promise<void> ready;
    worlds.create({"w" + std::to_string(i), "hall", false}, [&](auto) { ready.set_value(); });
    ready.get_future().get();
  }
  const std::size_t each = (readResidentBytes() - one) / kWorlds;
  EXPECT_EQ(worlds.allWorlds().size(), kWorlds + 1);
  if (!tests::kSanitized) {
    EXPECT_LT(each, kPosts * kMaxBytesPerBox + kMiB / 2) << one - before << " for the first";
    EXPECT_LT(each, (one - before) / 4);
  }
}

}  // namespace
}  // namespace enfilade::server::testing
