// Tests of playing a recording over the socket: every tick equals the recorded one after any seek.
// Contacts pair for every client, and a branch is a recording of its own.
#include <filesystem>
#include <map>
#include <random>
#include <set>

#include "server/recording/playback.hpp"
#include "server/recording/recordable_world.hpp"
#include "tests/server/body_room.hpp"
#include "tests/server/eventually.hpp"
#include "tests/server/served_room.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::server::testing {
namespace {

using Pair = std::pair<std::uint32_t, std::uint32_t>;
/// The active contacts, and the tick at which each began.
using Live = std::map<Pair, std::uint64_t>;

/// Applies events; contacts that begin twice or end without a beginning are faults.
void follow(Live& live, const v1::TickEvents& events) {
  for (const v1::ContactEvent& event : events.contacts()) {
    const Pair pair{event.a(), event.b()};
    if (event.kind() == v1::ContactEvent::KIND_BEGIN) {
      EXPECT_TRUE(live.emplace(pair, event.tick()).second) << event.ShortDebugString();
    } else if (event.kind() == v1::ContactEvent::KIND_END) {
      EXPECT_EQ(live.erase(pair), 1u) << event.ShortDebugString();
    }
  }
}

/// Recorded results by tick; 0 is before the first.
struct Walked {
  std::vector<std::uint64_t> hashes;
  std::vector<Live> live;
  std::uint64_t getLastTick() const { return hashes.size() - 1; }
};

constexpr std::uint64_t kTicks = 1600, kCyComes = 300, kCyLeaves = 900;

void commandWalkers(RecordableWorld& world, std::uint64_t tick) {
  v1::Command leave;
  leave.set_avatar("cy");
  leave.mutable_leave();
  if (tick == kCyComes) world.submit(spawn("cy", 2, 0, 2));
  if (tick == kCyComes)
    for (int i = 0; i < 9; ++i) world.submit(walkTo("cy", i % 2 ? 4.5 : -4.5, 0, 2));
  if (tick == kCyLeaves) world.submit(leave);
}

/// Ann and bob walk to and fro and into wall and column; cy comes and goes.
Walked recordWalk(const std::filesystem::path& file) {
  RecordableWorld world{scene::World(makeSmallRoom())};
  RecordingOptions options;
  options.choice.file = file;
  options.model.file = "room.obj";
  world.record(options);
  world.submit(spawn("ann", 0, 0, 0));
  world.submit(spawn("bob", 0, 0, 3));
  for (int i = 0; i < 4; ++i) {
    world.submit(walkTo("ann", 8, 0, 0));  // the wall blocks the way
    world.submit(walkTo("ann", -3, 0, -2));
    world.submit(walkTo("bob", 0, 0, 8));  // the column blocks the way
    world.submit(walkTo("bob", -4, 0, 1));
  }
  Walked walked{{world.snapshot()->stateHash}, {{}}};
  while (walked.getLastTick() < kTicks) {
    commandWalkers(world, walked.getLastTick());
    const auto ticked = world.tick();
    walked.hashes.push_back(world.snapshot()->stateHash);
    walked.live.push_back(walked.live.back());
    follow(walked.live.back(), ticked.events);
  }
  world.endContacts(v1::ContactEvent::REASON_SHUTDOWN);
  EXPECT_FALSE(world.recorder()->close());
  return walked;
}

/// A client that listens to a world, and its active contacts.
struct Listener {
  protocol::Client client;
  Live live = {};
  v1::Replay replay = {};

  explicit Listener(protocol::Client who) : client(std::move(who)) {
    v1::Subscribe contacts;
    contacts.set_contacts(true);
    const v1::SubscribeReply subscribed = client.subscribe(contacts);
    for (const v1::ContactEvent& event : subscribed.live())
      live[{event.a(), event.b()}] = event.tick();
    replay = client.welcome().replay();
  }
  /// Receives all messages sent before now.
  void hear() {
    client.metrics();
    for (const v1::ServerMessage& message : client.takeEvents()) {
      if (message.has_events()) follow(live, message.events());
      if (message.has_replay()) replay = message.replay();
    }
  }
};

class Replays : public ServedRoom {
 protected:
  void SetUp() override { walked_ = recordWalk(getFile("walk")); }
  void TearDown() override { server_.reset(); }
  std::filesystem::path getFile(const std::string& name) const {
    return folder_.getPath() / (name + ".mcap");
  }

  void play(const std::string& name = "walk", std::uint64_t from = 0,
            const std::string& branch = {}, Access access = {}) {
    ServerOptions options;
    options.world.replay = {getFile(name), from};
    options.access = std::move(access);
    if (!branch.empty()) {
      options.world.record.emplace();
      options.world.record->choice.file = getFile(branch);
      options.world.record->model.file = "room.obj";
      options.world.record->overwrite = false;
    }
    server_ =
        std::make_unique<Server>(makeSmallRoom(), HostPort{"127.0.0.1", 0}, std::move(options));
  }

  tests::TemporaryFolder folder_;
  Walked walked_;
};

/// The error of a request; ERROR_UNSPECIFIED if it succeeded.
v1::Error catchRequestError(const std::function<void()>& request) {
  v1::Error error;
  try {
    request();
  } catch (const protocol::ProtocolError& problem) {
    error.set_code(problem.code);
    error.set_message(problem.what());
  }
  return error;
}

/// Plays a whole recording with verification; returns its last hash.
std::uint64_t verifyRecording(const std::filesystem::path& file, std::uint32_t run = 1) {
  server::Playback playback(file, run);
  scene::World world = playback.restoreWorldAfter(playback.firstTick(), makeSmallRoom());
  try {
    while (playback.step(world)) {
    }
  } catch (const Divergence& diverged) {
    ADD_FAILURE() << formatDivergence(diverged);
  }
  EXPECT_TRUE(playback.closed());
  return world.snapshot()->stateHash;
}

TEST_F(Replays, EveryTickEqualsTheRecordedOneAndTheEndIsReported) {
  play();
  Listener ann{makeClient("ann")};
  EXPECT_EQ(ann.replay.file(), "walk.mcap");
  EXPECT_EQ(ann.replay.last_tick(), walked_.getLastTick());
  for (std::uint64_t tick = 1; tick <= 1000; ++tick)
    ASSERT_EQ(ann.client.step().state_hash(), walked_.hashes[tick]) << tick;
  const v1::StepReply rest = ann.client.step(10'000);
  EXPECT_EQ(rest.tick(), walked_.getLastTick()) << "a Step ends where the recording does";
  EXPECT_EQ(rest.state_hash(), walked_.hashes.back());
  ann.hear();
  EXPECT_TRUE(ann.replay.at_end());
  EXPECT_EQ(ann.live, walked_.live.back());
  const v1::Error ended = catchRequestError([&] { ann.client.step(); });
  EXPECT_EQ(ended.code(), v1::ERROR_REPLAY_ENDED);
  EXPECT_NE(ended.message().find("TakeOver"), std::string::npos) << ended.message();
}

TEST_F(Replays, AFreeRunPausesAtTheEnd) {
  play("walk", walked_.getLastTick() - 60);
  Listener ann{makeClient("ann")};
  v1::SetClock clock;
  clock.mutable_free_run()->set_speed(100);
  EXPECT_EQ(ann.client.setClock(clock).tick(), walked_.getLastTick() - 60);
  ASSERT_TRUE(becomesTrue([&] {
    ann.hear();
    return ann.replay.at_end();
  }));
  EXPECT_EQ(ann.replay.clock().mode(), v1::Clock::MODE_PAUSED);
  EXPECT_EQ(ann.replay.tick(), walked_.getLastTick());
}

TEST_F(Replays, AnyTickIsSoughtInAnyOrderAndContactsPairForAll) {
  server::Playback playback(getFile("walk"));
  playback.restoreWorldAfter(1500, makeSmallRoom());
  ASSERT_GT(playback.startTick(), 0u) << "without a checkpoint this tests less than it says";
  play();
  Listener driver{makeClient("driver")}, other{makeClient("other")};
  std::mt19937 random(7);
  for (int i = 0; i < 20; ++i) {
    const std::uint64_t tick = random() % walked_.hashes.size();
    ASSERT_EQ(driver.client.seek(tick).state_hash(), walked_.hashes[tick]) << tick;
    for (Listener* one : {&driver, &other}) {
      one->hear();
      EXPECT_EQ(one->live, walked_.live[tick]) << tick;
      EXPECT_EQ(one->replay.tick(), tick);
    }
    if (i % 4 == 1) {  // leaves a branch
      driver.client.takeOver();
      EXPECT_FALSE(driver.client.command(spawn("dee", -6, 0.01, -6)));
      EXPECT_NE(driver.client.step(20).state_hash(),
                walked_.hashes[std::min(tick + 20, walked_.getLastTick())]);
    } else if (tick + 30 <= walked_.getLastTick()) {
      ASSERT_EQ(driver.client.step(30).state_hash(), walked_.hashes[tick + 30]) << tick;
    }
  }
  const v1::Error beyond =
      catchRequestError([&] { driver.client.seek(walked_.getLastTick() + 1); });
  EXPECT_EQ(beyond.code(), v1::ERROR_BAD_MESSAGE);
}

TEST_F(Replays, ASeekIsDoneInEveryModeOfTheClockAndByTheDriverAlone) {
  play();
  Listener driver{makeClient("driver")}, other{makeClient("other")};
  v1::SetClock clock;
  clock.mutable_pause();
  driver.client.setClock(clock);
  EXPECT_EQ(driver.client.seek(700).tick(), 700u);
  EXPECT_EQ(catchRequestError([&] { other.client.seek(10); }).code(), v1::ERROR_NOT_ALLOWED);
  EXPECT_EQ(catchRequestError([&] { other.client.takeOver("ann"); }).code(), v1::ERROR_NOT_ALLOWED);
  clock.mutable_free_run()->set_speed(1000);
  driver.client.setClock(clock);
  for (const std::uint64_t tick : {1200u, 100u})
    EXPECT_EQ(driver.client.seek(tick).state_hash(), walked_.hashes[tick]);
}

TEST_F(Replays, SubscribersGetTheStateOfTheSoughtTick) {
  play();
  protocol::Client driver = makeClient("driver");
  v1::Subscribe states;
  states.set_state(true);
  driver.subscribe(states);
  driver.seek(800);
  bool seen = false;
  while (const auto event = driver.nextEvent(std::chrono::seconds(seen ? 0 : 20)))
    if (event->has_state() && event->state().tick() == 800) {
      EXPECT_EQ(event->state().hash(), walked_.hashes[800]);
      EXPECT_EQ(event->state().avatars_size(), 3);
      seen = true;
    }
  EXPECT_TRUE(seen);
}

TEST_F(Replays, AWatchContinuesWithAnImageOfTheSoughtTick) {
  play("walk", 1000);
  ENFILADE_NEED_PICTURES(*server_);
  protocol::Client driver = makeClient("driver");
  v1::ClientMessage message;
  v1::WatchFrames& watch = *message.mutable_watch_frames();
  watch.set_watch(1);
  watch.set_rate(1);
  watch.mutable_frame()->mutable_eyes()->set_avatar("ann");
  watch.mutable_frame()->set_width(800);
  watch.mutable_frame()->set_height(800);
  driver.request(message);
  const auto awaitFrame = [&](std::uint64_t tick) {
    while (const auto event = driver.nextEvent(std::chrono::seconds(20)))
      if (event->has_frame() && event->frame().tick() == tick) return true;
    return false;
  };
  driver.seek(700);  // while the first image is being drawn
  EXPECT_TRUE(awaitFrame(700));
  driver.seek(400);
  EXPECT_TRUE(awaitFrame(400)) << "also back, where less than a second has gone by";
  driver.step(60);
  EXPECT_TRUE(awaitFrame(460));
}

TEST_F(Replays, ALateClientGetsTheStateOfTheReplay) {
  play("walk", 500);
  Listener driver{makeClient("driver")};
  EXPECT_EQ(driver.live, walked_.live[500]);
  driver.client.step(150);
  Listener late{makeClient("late")};
  EXPECT_EQ(late.client.welcome().tick(), 650u);
  EXPECT_EQ(late.replay.tick(), 650u);
  EXPECT_FALSE(late.replay.branched());
  EXPECT_EQ(late.live, walked_.live[650]);
  EXPECT_FALSE(late.live.empty());
  const auto& offers = late.client.welcome().capabilities();
  EXPECT_NE(std::find(offers.begin(), offers.end(), "replay"), offers.end());
  driver.client.step(400);
  late.hear();
  EXPECT_EQ(late.live, walked_.live[1050]);
  driver.client.seek(1200);
  EXPECT_EQ(Listener{makeClient("later")}.live, walked_.live[1200]);
}

/// The persisting contacts among the received events, all of tick `tick`.
std::set<Pair> takePersisting(protocol::Client& client, std::uint64_t tick) {
  std::set<Pair> persists;
  for (const v1::ServerMessage& message : client.takeEvents()) {
    for (const v1::ContactEvent& event : message.events().contacts()) {
      EXPECT_EQ(event.kind(), v1::ContactEvent::KIND_PERSIST);
      EXPECT_EQ(event.tick(), tick);
      EXPECT_TRUE(persists.insert({event.a(), event.b()}).second) << event.ShortDebugString();
    }
  }
  return persists;
}

/// The contacts that are active after the tick and began before it.
std::set<Pair> findLasting(const Live& live, std::uint64_t tick) {
  std::set<Pair> pairs;
  for (const auto& [pair, begun] : live)
    if (begun < tick) pairs.insert(pair);
  return pairs;
}

TEST_F(Replays, ContactsPersistInTheRecordedTicks) {
  play("walk", 200);
  protocol::Client driver = makeClient("driver");
  v1::Subscribe persists;
  persists.set_persists(true);
  driver.subscribe(persists);
  std::size_t persisted = 0;
  for (const std::uint64_t from : {200u, 1000u, 100u}) {
    driver.seek(from);
    EXPECT_EQ(takePersisting(driver, from), std::set<Pair>()) << "a seek is no tick";
    for (std::uint64_t tick = from + 1; tick <= from + 300; ++tick) {
      driver.step();
      const std::set<Pair> pairs = takePersisting(driver, tick);
      EXPECT_EQ(pairs, findLasting(walked_.live[tick], tick)) << tick;
      persisted += pairs.size();
    }
  }
  EXPECT_GT(persisted, 900u);
  driver.takeOver();
  driver.step();
  EXPECT_FALSE(takePersisting(driver, 401).empty()) << "in a branch, too";
}

TEST_F(Replays, CommandsAreRefusedUntilAClientTakesOver) {
  play("walk", 400);
  protocol::Client driver = makeClient("driver"), other = makeClient("other");
  v1::BodyCommand door;
  door.set_body("door");
  v1::ClientMessage restart;
  restart.mutable_restart();
  for (const auto& refused : {driver.command(spawn("dee", -6, 0.01, -6)), driver.bodyCommand(door),
                              std::optional(catchRequestError([&] { driver.request(restart); }))}) {
    ASSERT_TRUE(refused);
    EXPECT_EQ(refused->code(), v1::ERROR_NOT_ALLOWED);
    EXPECT_NE(refused->message().find("TakeOver"), std::string::npos);
  }
  driver.step();
  EXPECT_EQ(catchRequestError([&] { driver.takeOver("unknown"); }).code(),
            v1::ERROR_UNKNOWN_AVATAR);
  EXPECT_EQ(driver.takeOver("ann").tick(), 401u);
  EXPECT_FALSE(driver.command(walkTo("ann", -9, 0, -9)));
  EXPECT_TRUE(other.command(walkTo("ann", 0, 0, 0))) << "she is the driver's";
  EXPECT_TRUE(other.command(walkTo("bob", 0, 0, 0))) << "bob has no owner";
  EXPECT_TRUE(other.command(spawn("bob", -9, 0.01, 9))) << "nor can he be had by a spawn";
  EXPECT_EQ(catchRequestError([&] { other.takeOver("ann"); }).code(), v1::ERROR_NOT_ALLOWED);
  other.takeOver("bob");
  EXPECT_FALSE(other.command(walkTo("bob", 0, 0, 0)));
  EXPECT_FALSE(other.command(spawn("dee", -6, 0.01, -6)));
  const v1::StepReply reply = driver.step(1200, true);
  ASSERT_EQ(reply.avatars_size(), 4);
  EXPECT_NEAR(reply.avatars(0).feet().x(), -9, 0.01) << "ann walked to the driver's target";
  EXPECT_NEAR(reply.avatars(1).feet().x(), 0, 0.01);
}

TEST_F(Replays, AvatarsThatAreNotTakenOverFinishTheirOrders) {
  play("walk", 400);
  protocol::Client driver = makeClient("driver");
  driver.takeOver();
  // No more is recorded for ann and bob; cy would have received the command to leave.
  EXPECT_EQ(driver.step(kCyLeaves - 400).state_hash(), walked_.hashes[kCyLeaves]);
  EXPECT_NE(driver.step(1).state_hash(), walked_.hashes[kCyLeaves + 1]);
}

/// Reads a branch: its contacts pair, and those active at its start have their first tick.
Live readBeginning(const std::filesystem::path& file) {
  protocol::RecordingReader reader(file);
  Live live, beginning;
  std::uint64_t first = 0;
  while (const auto item = reader.next()) {
    if (const auto* start = std::get_if<v1::RecordingStart>(&*item)) first = start->parent().tick();
    if (const auto* events = std::get_if<v1::TickEvents>(&*item)) {
      follow(live, *events);
      if (events->tick() == first) beginning = live;
    }
  }
  EXPECT_EQ(live, Live()) << "each has its end";
  return beginning;
}

TEST_F(Replays, BranchesAreRecordingsOfTheirOwn) {
  play("walk", 0, "branch");
  std::uint64_t first = 0, second = 0;
  {
    protocol::Client driver = makeClient("driver");
    driver.seek(1000);
    EXPECT_FALSE(std::filesystem::exists(getFile("branch"))) << "nothing has branched yet";
    driver.takeOver("ann");
    EXPECT_FALSE(driver.command(walkTo("ann", -9, 0, -9)));
    first = driver.step(300).state_hash();
    driver.seek(630);
    driver.step(10);  // belongs to no branch
    EXPECT_FALSE(driver.metrics().has_recording());
    driver.takeOver("cy");
    EXPECT_FALSE(driver.command(walkTo("cy", 0, 0, -8)));
    second = driver.step(200).state_hash();
  }
  server_->stop();
  EXPECT_EQ(verifyRecording(getFile("branch")), first);
  EXPECT_EQ(verifyRecording(getFile("branch-2")), second);
  EXPECT_EQ(readBeginning(getFile("branch")), walked_.live[1000]);
  EXPECT_EQ(readBeginning(getFile("branch-2")), walked_.live[640]);
  EXPECT_TRUE(server_->isRecordingComplete());
  const server::Playback branch(getFile("branch"));
  EXPECT_EQ(branch.start().parent().file(), std::filesystem::absolute(getFile("walk")));
  EXPECT_EQ(branch.firstTick(), 1000u);
}

TEST_F(Replays, ARestartDirectlyAfterTakeOverIsARunOfItsOwn) {
  play("walk", 1000, "branch");
  std::uint64_t last = 0;
  {
    protocol::Client driver = makeClient("driver");
    driver.takeOver();
    v1::ClientMessage restart;
    restart.mutable_restart();
    EXPECT_EQ(driver.request(restart).restart().tick(), 0u);
    last = driver.step(5).state_hash();
  }
  server_->stop();
  EXPECT_TRUE(server_->isRecordingComplete());
  EXPECT_EQ(server::Playback(getFile("branch"), 1).firstTick(), 1000u);
  EXPECT_EQ(verifyRecording(getFile("branch"), 2), last);
}

TEST_F(Replays, ABranchIsPlayedAndLeftInItsTurn) {
  play("walk", 1000, "branch");
  {
    protocol::Client driver = makeClient("driver");
    driver.takeOver("ann");
    EXPECT_FALSE(driver.command(walkTo("ann", -9, 0, -9)));
    driver.step(300);
  }
  server_.reset();
  play("branch", 1000, "again");
  std::uint64_t last = 0;
  {
    Listener driver{makeClient("driver")};
    EXPECT_EQ(driver.replay.first_tick(), 1000u);
    EXPECT_EQ(driver.live, walked_.live[1000]);
    EXPECT_EQ(catchRequestError([&] { driver.client.seek(999); }).code(), v1::ERROR_BAD_MESSAGE);
    driver.client.seek(driver.replay.last_tick());
    driver.client.takeOver("bob");
    last = driver.client.step(50).state_hash();
  }
  server_->stop();
  EXPECT_EQ(verifyRecording(getFile("again")), last);
}

/// Copies a recording with a changed state at tick `tick`.
void falsify(const std::filesystem::path& from, const std::filesystem::path& to,
             std::uint64_t falseTick) {
  protocol::RecordingReader reader(from);
  protocol::RecordingWriter writer(to, "test");
  const double second = scene::WorldSettings{}.tickDuration;
  while (auto item = reader.next()) {
    if (auto* start = std::get_if<v1::RecordingStart>(&*item)) writer.write(*start);
    if (auto* names = std::get_if<v1::RecordedNames>(&*item)) writer.write(*names);
    if (auto* commands = std::get_if<v1::RecordedCommands>(&*item))
      writer.write(*commands, static_cast<double>(commands->tick()) * second);
    if (auto* events = std::get_if<v1::TickEvents>(&*item)) writer.write(*events);
    if (auto* state = std::get_if<v1::State>(&*item)) {
      if (state->tick() == falseTick) state->mutable_avatars(0)->mutable_feet()->set_x(1);
      if (state->tick() == falseTick) state->set_hash(1);
      writer.write(*state);
    }
  }
  writer.close();
}

TEST_F(Replays, AReplayThatDivergesStopsBeforeIt) {
  falsify(getFile("walk"), getFile("false"), 40);
  play("false");
  Listener driver{makeClient("driver")};
  const v1::StepReply reply = driver.client.step(100);
  EXPECT_EQ(reply.tick(), 39u);
  EXPECT_EQ(reply.state_hash(), walked_.hashes[39]);
  driver.hear();
  EXPECT_EQ(driver.replay.diverged().rfind("tick 40: ann: feet.x: recorded 1, replayed ", 0), 0u)
      << driver.replay.diverged();
  EXPECT_EQ(driver.live, walked_.live[39]);
  EXPECT_EQ(catchRequestError([&] { driver.client.step(); }).code(), v1::ERROR_REPLAY_ENDED);
  EXPECT_EQ(catchRequestError([&] { driver.client.seek(41); }).code(), v1::ERROR_REPLAY_ENDED);
  EXPECT_EQ(driver.client.metrics().ticks(), 39u) << "a wrong tick is not sent";
  EXPECT_EQ(driver.client.seek(10).state_hash(), walked_.hashes[10]);
  driver.hear();
  EXPECT_EQ(driver.replay.diverged(), "");
  EXPECT_EQ(catchRequestError([&] { driver.client.seek(41); }).code(), v1::ERROR_REPLAY_ENDED);
  EXPECT_EQ(driver.client.step(29).state_hash(), walked_.hashes[39]) << "it stands where it stood";
  EXPECT_EQ(catchRequestError([&] { driver.client.step(); }).code(), v1::ERROR_REPLAY_ENDED);
  driver.client.takeOver();
  EXPECT_EQ(driver.client.step().tick(), 40u);
  driver.hear();
  EXPECT_EQ(driver.live, walked_.live[40]);
}

TEST_F(Replays, AnotherSceneIsNotPlayed) {
  ServerOptions options;
  options.world.replay = {getFile("walk"), 0};
  scene::Model empty = makeSmallRoom()->model();
  empty.objects.pop_back();
  EXPECT_THROW(Server(std::make_shared<const scene::Scene>(std::move(empty)),
                      HostPort{"127.0.0.1", 0}, std::move(options)),
               Divergence);
}

TEST_F(Replays, ACutOffRecordingIsPlayedToItsLastTick) {
  std::filesystem::resize_file(getFile("walk"),
                               std::filesystem::file_size(getFile("walk")) * 4 / 10);
  play();
  Listener driver{makeClient("driver")};
  const std::uint64_t last = driver.replay.last_tick();
  EXPECT_GT(last, 100u);
  EXPECT_LT(last, walked_.getLastTick());
  EXPECT_EQ(driver.client.step(10'000).state_hash(), walked_.hashes[last]);
  driver.hear();
  EXPECT_EQ(driver.live, walked_.live[last]);
  EXPECT_TRUE(driver.replay.at_end());
}

/// Walks through the zone while the door opens; returns the tick of entering the zone.
std::uint64_t recordVisit(const std::filesystem::path& file, std::vector<std::uint64_t>& hashes) {
  RecordableWorld world{scene::World(makeBodyRoom())};
  RecordingOptions options;
  options.choice.file = file;
  options.model.file = "room.obj";
  world.record(options);
  v1::BodyCommand open;
  open.set_body("door");
  open.mutable_open();
  world.submit(spawn("ann", -6, 0, 0));
  world.submit(walkTo("ann", 0, 0, 0));
  world.submit(open);
  std::uint64_t entered = 0;
  hashes = {world.snapshot()->stateHash};
  while (hashes.size() <= 240) {
    const auto ticked = world.tick();
    hashes.push_back(world.snapshot()->stateHash);
    for (const v1::ContactEvent& event : ticked.events.contacts())
      if (event.kind() == v1::ContactEvent::KIND_ENTER) entered = event.tick();
  }
  EXPECT_FALSE(world.recorder()->close());
  return entered;
}

/// The trigger events among the received ones: kind, reason, tick.
std::vector<std::tuple<v1::ContactEvent::Kind, v1::ContactEvent::Reason, std::uint64_t>> takeVisits(
    protocol::Client& client) {
  std::vector<std::tuple<v1::ContactEvent::Kind, v1::ContactEvent::Reason, std::uint64_t>> found;
  for (const v1::ServerMessage& message : client.takeEvents())
    for (const v1::ContactEvent& event : message.events().contacts())
      if (event.b() == kZone) found.emplace_back(event.kind(), event.reason(), event.tick());
  return found;
}

TEST_F(Replays, DoorsAreOpenedAgainAndTriggersPairLikeContacts) {
  using Event = v1::ContactEvent;
  std::vector<std::uint64_t> hashes;
  const std::uint64_t entered = recordVisit(getFile("visit"), hashes);
  ASSERT_GT(entered, 10u);
  ServerOptions options;
  options.world.replay = {getFile("visit"), entered + 5};
  server_ = std::make_unique<Server>(makeBodyRoom(), HostPort{"127.0.0.1", 0}, std::move(options));
  protocol::Client driver = makeClient("driver");
  driver.subscribe(makeFullSubscription());
  driver.seek(entered - 5);
  using Visits = decltype(takeVisits(driver));
  EXPECT_EQ(takeVisits(driver), (Visits{{Event::KIND_LEAVE, Event::REASON_SEEK, entered + 5}}));
  driver.seek(entered + 3);
  EXPECT_EQ(takeVisits(driver), (Visits{{Event::KIND_ENTER, Event::REASON_UNSPECIFIED, entered}}));
  driver.seek(2);
  EXPECT_EQ(driver.step(238).state_hash(), hashes[240]);
}

TEST_F(Replays, ObserversMayNotSeekOrTakeOver) {
  Access access;
  access.tokens = {{Role::observe, "observer-0123456789"}, {Role::drive, "driver-0123456789"}};
  play("walk", 0, "", access);
  protocol::Client observer = makeClient("observer", "observer-0123456789");
  EXPECT_EQ(catchRequestError([&] { observer.seek(10); }).code(), v1::ERROR_NOT_ALLOWED);
  EXPECT_EQ(catchRequestError([&] { observer.takeOver("ann"); }).code(), v1::ERROR_NOT_ALLOWED);
  EXPECT_EQ(makeClient("driver", "driver-0123456789").seek(10).tick(), 10u);
}

TEST_F(Replays, OtherWorldsOfTheServerAreLive) {
  play();
  protocol::Client main = makeClient("main");
  v1::ClientMessage create;
  create.mutable_create_world()->set_name("live");
  main.request(create);
  protocol::Client live = makeClient("ann", "", "live");
  EXPECT_FALSE(live.welcome().has_replay());
  EXPECT_FALSE(live.command(spawn("ann", 0, 0.01, 0)));
  EXPECT_EQ(live.step(1, true).avatars_size(), 1);
  EXPECT_EQ(catchRequestError([&] { live.seek(1); }).code(), v1::ERROR_NOT_ALLOWED);
  EXPECT_EQ(catchRequestError([&] { live.takeOver(); }).code(), v1::ERROR_NOT_ALLOWED);
}

}  // namespace
}  // namespace enfilade::server::testing
