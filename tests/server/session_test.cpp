// Tests of well-behaved clients of a real server.
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <thread>

#include "scene/world/world.hpp"
#include "server/base/server_error.hpp"
#include "server/hosting/requests/dispatch.hpp"
#include "server/worlds/tick_loop.hpp"
#include "tests/server/eventually.hpp"
#include "tests/server/raw_connection.hpp"
#include "tests/server/served_room.hpp"
#include "tests/support/sanitized.hpp"

namespace enfilade::server::testing {
namespace {

class Sessions : public ServedRoom {};

/// The code of the ProtocolError that `request` throws; ERROR_UNSPECIFIED if it throws none.
v1::ErrorCode catchErrorCode(const std::function<void()>& request) {
  try {
    request();
  } catch (const protocol::ProtocolError& error) {
    return error.code;
  }
  return v1::ERROR_UNSPECIFIED;
}

TEST_F(Sessions, WelcomeHasTheSceneAndItsPolicies) {
  serve();
  const protocol::Client ann = makeClient("ann");
  const v1::Welcome& welcome = ann.welcome();
  EXPECT_EQ(welcome.protocol_version(), protocol::kVersion);
  EXPECT_EQ(welcome.scene().source(), "small_room");
  EXPECT_EQ(welcome.scene().objects(), 3u);
  EXPECT_EQ(welcome.scene().hash(), makeSmallRoom()->hash());
  EXPECT_DOUBLE_EQ(welcome.scene().bounds().max().x(), 10);
  EXPECT_DOUBLE_EQ(welcome.policies().tick(), scene::WorldSettings{}.tickDuration);
  EXPECT_NEAR(welcome.policies().walkable_slope(), 50 * 3.14159265358979 / 180, 1e-9);
  EXPECT_EQ(welcome.limits().max_message(), protocol::kServerLimits.total);
  EXPECT_EQ(welcome.tick(), 0u);
  EXPECT_EQ(welcome.clock().mode(), v1::Clock::MODE_LOCKSTEP);
  EXPECT_EQ(welcome.renderer(), server_->rendererName());
}

TEST_F(Sessions, ASubscriberToStatesGetsThePresentOneAtOnce) {
  serve();
  protocol::Client driver = makeClient("driver");
  ASSERT_FALSE(driver.command(spawn("ann", 0, 0.01, 0)));
  driver.step(5);
  RawConnection late(server_->port());
  late.sendHello();
  ASSERT_TRUE(late.receive()->has_welcome());
  v1::ClientMessage subscribe;
  subscribe.set_request_id(2);
  subscribe.mutable_subscribe()->set_state(true);
  late.send(subscribe);
  ASSERT_TRUE(late.receive()->has_subscribe());
  const auto state = late.receive();
  ASSERT_TRUE(state && state->has_state());
  EXPECT_EQ(state->state().tick(), 5u);
  ASSERT_EQ(state->state().avatars_size(), 1);
  EXPECT_EQ(state->state().avatars(0).name(), "ann");
}

TEST_F(Sessions, ChangesOfTheClockArePushedAndItsDriverMayHandItBack) {
  serve();
  RawConnection watcher(server_->port());
  watcher.sendHello();
  ASSERT_TRUE(watcher.receive()->has_welcome());
  v1::ClientMessage subscribe;
  subscribe.set_request_id(2);
  subscribe.mutable_subscribe()->set_clock(true);
  watcher.send(subscribe);
  ASSERT_TRUE(watcher.receive()->has_subscribe());

  protocol::Client first = makeClient("first"), second = makeClient("second");
  v1::ClientMessage pause;
  pause.mutable_set_clock()->mutable_pause();
  first.request(pause);
  EXPECT_EQ(catchErrorCode([&] { second.request(pause); }), v1::ERROR_NOT_ALLOWED);
  v1::ClientMessage release;
  release.mutable_set_clock()->set_release(true);
  EXPECT_EQ(catchErrorCode([&] { second.request(release); }), v1::ERROR_NOT_ALLOWED);
  EXPECT_FALSE(first.request(release).set_clock().clock().has_driver());
  second.request(pause);

  std::vector<std::pair<v1::Clock::Mode, bool>> changes;
  while (changes.size() < 4) {
    const auto message = watcher.receive();
    ASSERT_TRUE(message && message->has_clock()) << changes.size();
    changes.emplace_back(message->clock().clock().mode(), message->clock().clock().has_driver());
  }
  using Clock = v1::Clock;
  EXPECT_EQ(changes, (std::vector<std::pair<Clock::Mode, bool>>{{Clock::MODE_LOCKSTEP, true},
                                                                {Clock::MODE_PAUSED, true},
                                                                {Clock::MODE_PAUSED, false},
                                                                {Clock::MODE_PAUSED, true}}));
}

TEST_F(Sessions, UnknownEnumValuesAreRefusedByTheirPath) {
  serve();
  protocol::Client ann = makeClient("ann");
  const auto fieldThrown = [&](const v1::ClientMessage& message) -> std::string {
    try {
      ann.request(message);
    } catch (const protocol::ProtocolError& error) {
      EXPECT_EQ(error.code, v1::ERROR_BAD_MESSAGE) << error.what();
      return error.field;
    }
    return "accepted";
  };
  v1::ClientMessage query;
  query.mutable_cannot_touch()->set_assume(static_cast<v1::CannotTouchQuery::Assume>(7));
  EXPECT_EQ(fieldThrown(query), "cannot_touch.assume");
  v1::ClientMessage frame;
  frame.mutable_frame()->add_channels(v1::CHANNEL_RGB);
  frame.mutable_frame()->add_channels(static_cast<v1::Channel>(99));
  EXPECT_EQ(fieldThrown(frame), "frame.channels[1]");
  v1::ClientMessage chain;
  chain.mutable_command()->mutable_spawn()->add_links()->mutable_joint()->set_kind(
      static_cast<v1::Joint::Kind>(-1));
  EXPECT_EQ(ann.command(chain.command())->field(), "spawn.links[0].joint.kind");
  v1::ClientMessage horizon;
  horizon.mutable_subscribe()->mutable_contact_horizon()->set_assume(
      static_cast<v1::CannotTouchQuery::Assume>(9));
  EXPECT_EQ(fieldThrown(horizon), "subscribe.contact_horizon.assume");
}

TEST_F(Sessions, ALongNameIsNotEchoedInFull) {
  serve();
  protocol::Client ann = makeClient("ann");
  v1::ClientMessage message;
  message.mutable_touching()->mutable_entity()->set_name(std::string(100'000, 'x'));
  try {
    ann.request(message);
    FAIL() << "no error";
  } catch (const protocol::ProtocolError& error) {
    EXPECT_LT(std::string(error.what()).size(), 1200u);
  }
}

TEST_F(Sessions, TwoClientsHearTheSameContacts) {
  serve();
  protocol::Client ann = makeClient("ann"), bob = makeClient("bob");
  bob.subscribe(makeFullSubscription());
  ann.subscribe(makeFullSubscription());
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.01, 0)));
  ASSERT_FALSE(ann.command(walkTo("ann", 8, 0, 0)));
  ReceivedEvents annEvents, bobEvents;
  for (int i = 0; i < 400; ++i) {
    ann.step();
    annEvents.add(ann.takeEvents());
  }
  bob.metrics();
  bobEvents.add(bob.takeEvents());
  ASSERT_GE(annEvents.count(v1::ContactEvent::KIND_BEGIN), 2u) << "the floor and the wall";
  ASSERT_EQ(annEvents.contacts.size(), bobEvents.contacts.size());
  for (std::size_t i = 0; i < annEvents.contacts.size(); ++i) {
    EXPECT_EQ(annEvents.contacts[i].SerializeAsString(), bobEvents.contacts[i].SerializeAsString());
  }
  const auto blocked = std::find_if(
      bobEvents.notices.begin(), bobEvents.notices.end(),
      [](const v1::Notice& notice) { return notice.kind() == v1::Notice::KIND_BLOCKED; });
  ASSERT_NE(blocked, bobEvents.notices.end());
  EXPECT_EQ(blocked->obstacle_name(), "room_wall");
}

TEST_F(Sessions, OnlyTheDriverStepsAndTheNextOneMayWhenItLeft) {
  serve();
  protocol::Client bob = makeClient("bob");
  {
    protocol::Client ann = makeClient("ann");
    ann.step();
    EXPECT_EQ(catchErrorCode([&] { bob.step(); }), v1::ERROR_NOT_ALLOWED);
    v1::SetClock pause;
    pause.mutable_pause();
    EXPECT_EQ(catchErrorCode([&] { bob.setClock(pause); }), v1::ERROR_NOT_ALLOWED);
    EXPECT_EQ(ann.step().tick(), 2u) << "the refused step made no tick";
  }
  EXPECT_TRUE(
      becomesTrue([&] { return catchErrorCode([&] { bob.step(); }) == v1::ERROR_UNSPECIFIED; }));
}

TEST_F(Sessions, StepsBeyondTheLimitAreRefused) {
  serve();
  protocol::Client ann = makeClient("ann");
  EXPECT_EQ(catchErrorCode([&] { ann.step(0); }), v1::ERROR_BAD_MESSAGE);
  EXPECT_EQ(catchErrorCode([&] { ann.step(ann.welcome().limits().max_ticks_per_step() + 1); }),
            v1::ERROR_BAD_MESSAGE);
  EXPECT_EQ(ann.step(50).tick(), 50u);
}

TEST_F(Sessions, AnAvatarObeysOnlyItsOwner) {
  serve();
  protocol::Client ann = makeClient("ann"), bob = makeClient("bob");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.01, 0)));
  const auto error = bob.command(walkTo("ann", 1, 0, 0));
  ASSERT_TRUE(error);
  EXPECT_EQ(error->code(), v1::ERROR_NOT_ALLOWED);
  EXPECT_EQ(error->field(), "avatar");
  ann.step();
  EXPECT_TRUE(bob.command(spawn("ann", 3, 0.01, 0))) << "nor is its name free";
}

TEST_F(Sessions, ALeftAvatarsNameIsFreeAgain) {
  serve();
  protocol::Client ann = makeClient("ann"), bob = makeClient("bob");
  ASSERT_FALSE(ann.command(spawn("guest", 0, 0.01, 0)));
  ann.step();
  v1::Command leave;
  leave.set_avatar("guest");
  leave.mutable_leave();
  ASSERT_FALSE(ann.command(leave));
  ann.step(3);
  EXPECT_FALSE(bob.command(spawn("guest", 1, 0.01, 0)));
  EXPECT_EQ(ann.step(2, true).avatars_size(), 1);
}

TEST_F(Sessions, ANameIsFreeAlsoAfterItsSpawnWasRefused) {
  serve();
  protocol::Client ann = makeClient("ann"), bob = makeClient("bob");
  v1::Command leave;
  leave.set_avatar("guest");
  leave.mutable_leave();
  ASSERT_FALSE(ann.command(spawn("guest", 0, 0.01, 0)));
  ASSERT_FALSE(ann.command(spawn("guest", 0, 0.01, 0)));  // refused: the name exists already
  ASSERT_FALSE(ann.command(leave));
  ASSERT_FALSE(ann.command(spawn("guest", 0, 0.01, 0)));  // queued: the name is still ann's
  EXPECT_EQ(ann.step(2, true).avatars_size(), 0);
  EXPECT_TRUE(bob.command(spawn("guest", 1, 0.01, 0)));
  EXPECT_EQ(ann.step(1, true).avatars_size(), 1);
  ASSERT_FALSE(ann.command(leave));
  ann.step(3);
  EXPECT_FALSE(bob.command(spawn("guest", 1, 0.01, 0)));
}

TEST_F(Sessions, AVanishedClientsAvatarLeavesAndItsContactsEnd) {
  serve();
  protocol::Client bob = makeClient("bob");
  bob.subscribe(makeFullSubscription());
  ReceivedEvents received;
  {
    protocol::Client ann = makeClient("ann");
    ASSERT_FALSE(ann.command(spawn("ann", 0, 0.01, 0)));
    ASSERT_FALSE(ann.command(walkTo("ann", 9, 0, 6)));
    bob.step(30);
    received.add(bob.takeEvents());
    ASSERT_GE(received.count(v1::ContactEvent::KIND_BEGIN), 1u);
  }
  EXPECT_TRUE(becomesTrue([&] {
    const bool gone = bob.step(1, true).avatars().empty();
    received.add(bob.takeEvents());
    return gone;
  }));
  EXPECT_EQ(received.count(v1::ContactEvent::KIND_BEGIN),
            received.count(v1::ContactEvent::KIND_END));
  EXPECT_EQ(received.contacts.back().reason(), v1::ContactEvent::REASON_LEFT);
}

TEST_F(Sessions, ALateSubscriberGetsTheActiveContacts) {
  serve();
  protocol::Client ann = makeClient("ann"), bob = makeClient("bob");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.01, 0)));
  ann.step(60);
  const v1::SubscribeReply reply = bob.subscribe(makeFullSubscription());
  ASSERT_EQ(reply.live_size(), 1);
  EXPECT_EQ(reply.live(0).b(), kFloor);
  EXPECT_EQ(reply.live(0).b_name(), "room_floor");
  EXPECT_EQ(reply.tick(), 60u);
}

using Pair = std::pair<std::uint32_t, std::uint32_t>;

/// The active contacts by the begin and end events. Each tick must report exactly the earlier ones
/// that continue as persisting, once each and after all other events.
struct Followed {
  std::set<Pair> live = {};

  void add(const std::deque<v1::ServerMessage>& messages, std::uint64_t tick) {
    std::set<Pair> persists, begun;
    for (const v1::ServerMessage& message : messages) {
      for (const v1::ContactEvent& event : message.events().contacts()) {
        EXPECT_EQ(event.tick(), tick);
        const Pair pair{event.a(), event.b()};
        const bool isPersist = event.kind() == v1::ContactEvent::KIND_PERSIST;
        EXPECT_TRUE(isPersist || persists.empty()) << event.ShortDebugString();
        if (isPersist) {
          EXPECT_TRUE(persists.insert(pair).second) << event.ShortDebugString();
        }
        if (event.kind() == v1::ContactEvent::KIND_BEGIN) begun.insert(pair);
        if (event.kind() == v1::ContactEvent::KIND_END) live.erase(pair);
      }
    }
    EXPECT_EQ(persists, live) << tick;
    live.merge(begun);
  }
};

v1::Subscribe addPersists(v1::Subscribe subscription) {
  subscription.set_persists(true);
  return subscription;
}

/// Queries the pair, whose state must equal the event of the last tick.
void expectAsItIsNow(protocol::Client& client, const v1::ContactEvent& event) {
  v1::DistanceQuery query;
  query.add_pairs()->mutable_a()->set_id(event.a());
  query.mutable_pairs(0)->mutable_b()->set_id(event.b());
  const v1::PairState now = client.distances(query).pairs(0);
  EXPECT_EQ(event.verdict(), now.verdict());
  EXPECT_NEAR(event.distance(), now.distance(), event.error_bound() + now.error_bound());
  const v1::Vec3 &reported = event.normal(), &asked = now.normal();
  EXPECT_NEAR(reported.x() * asked.x() + reported.y() * asked.y() + reported.z() * asked.z(), 1,
              1e-6);
  EXPECT_EQ(event.a_name(), now.a_name());
  EXPECT_EQ(event.b_name(), now.b_name());
}

TEST_F(Sessions, AContactPersistsInEachTickBetweenBeginAndEnd) {
  serve();
  protocol::Client ann = makeClient("ann");
  const auto& offers = ann.welcome().capabilities();
  EXPECT_NE(std::find(offers.begin(), offers.end(), "persists"), offers.end());
  ann.subscribe(addPersists(makeFullSubscription()));
  ASSERT_FALSE(ann.command(spawn("ann", 4, 0.01, 0)));
  ASSERT_FALSE(ann.command(walkTo("ann", 8, 0, 0)));
  ASSERT_FALSE(ann.command(walkTo("ann", 3, 0, 0)));
  Followed followed;
  std::vector<v1::ContactEvent> wall;
  for (int i = 0; i < 300; ++i) {
    const std::uint64_t tick = ann.step().tick();
    const auto messages = ann.takeEvents();
    followed.add(messages, tick);
    ReceivedEvents received;
    received.add(messages);
    for (const v1::ContactEvent& event : received.contacts) {
      if (event.kind() == v1::ContactEvent::KIND_PERSIST) expectAsItIsNow(ann, event);
      if (event.b() == kWall && event.kind() != v1::ContactEvent::KIND_BLOCKED)
        wall.push_back(event);
    }
  }
  EXPECT_EQ(followed.live.size(), 1u) << "the floor";
  ASSERT_GT(wall.size(), 100u) << "she tries for two seconds";
  EXPECT_EQ(wall.front().kind(), v1::ContactEvent::KIND_BEGIN);
  EXPECT_EQ(wall.back().kind(), v1::ContactEvent::KIND_END);
  for (std::size_t i = 1; i + 1 < wall.size(); ++i)
    EXPECT_EQ(wall[i].kind(), v1::ContactEvent::KIND_PERSIST);
  EXPECT_EQ(wall.back().tick() - wall.front().tick(), wall.size() - 1);
}

TEST_F(Sessions, PersistsReachOnlySubscribers) {
  serve();
  protocol::Client ann = makeClient("ann"), bob = makeClient("bob"), cy = makeClient("cy");
  ann.subscribe(addPersists(makeFullSubscription()));
  bob.subscribe(makeFullSubscription());
  EXPECT_EQ(cy.subscribe(addPersists({})).live_size(), 0);
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.01, 0)));
  ann.step(60);
  ReceivedEvents annEvents, bobEvents, cyEvents;
  annEvents.add(ann.takeEvents());
  bob.metrics();
  bobEvents.add(bob.takeEvents());
  cy.metrics();
  const auto messages = cy.takeEvents();
  cyEvents.add(messages);
  const std::size_t persists = annEvents.count(v1::ContactEvent::KIND_PERSIST);
  EXPECT_GT(persists, 30u) << "the floor";
  EXPECT_EQ(bobEvents.count(v1::ContactEvent::KIND_PERSIST), 0u);
  EXPECT_EQ(bobEvents.contacts.size() + persists, annEvents.contacts.size());
  EXPECT_EQ(cyEvents.contacts.size(), persists) << "and nothing else";
  EXPECT_EQ(cyEvents.count(v1::ContactEvent::KIND_PERSIST), persists);
  EXPECT_EQ(messages.size(), persists) << "no tick without one";
  for (std::size_t i = 0; i < messages.size(); ++i)
    EXPECT_EQ(messages[i].events().sequence(), i + 1);
  EXPECT_EQ(bob.subscribe(addPersists(makeFullSubscription())).live_size(), 1);
  ann.subscribe(makeFullSubscription());
  ann.step(3);
  ReceivedEvents annThen, bobThen;
  annThen.add(ann.takeEvents());
  bob.metrics();
  bobThen.add(bob.takeEvents());
  EXPECT_EQ(annThen.count(v1::ContactEvent::KIND_PERSIST), 0u);
  EXPECT_EQ(bobThen.count(v1::ContactEvent::KIND_PERSIST), 3u) << "from the next tick on";
}

TEST_F(Sessions, ANonFiniteNumberIsRefusedByItsField) {
  serve();
  protocol::Client ann = makeClient("ann");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto spawned = ann.command(spawn("ann", 0, nan, 0));
  ASSERT_TRUE(spawned);
  EXPECT_EQ(spawned->code(), v1::ERROR_REFUSED_COMMAND);
  EXPECT_EQ(spawned->field(), "spawn.at.y");
  v1::Command far = walkTo("ann", 1, 0, 0);
  *far.mutable_walk()->add_along() = makeVec(0, 0, 1e300);
  EXPECT_EQ(ann.command(far)->field(), "walk.along[1].z");
  EXPECT_NE(ann.command(far)->message().find("is 1e+300 m; give -10000000 to 10000000 m"),
            std::string::npos);
  v1::Command empty;
  empty.set_avatar("ann");
  EXPECT_EQ(ann.command(empty)->code(), v1::ERROR_BAD_MESSAGE);
  empty.mutable_spawn();
  EXPECT_EQ(ann.command(empty)->field(), "spawn.at");
  v1::Command chain = spawn("arm", 0, 0.01, 0);
  v1::Joint& joint = *chain.mutable_spawn()->add_links()->mutable_joint();
  *joint.mutable_axis() = makeVec(0, 1, 0);
  joint.set_kind(static_cast<v1::Joint::Kind>(7));
  EXPECT_EQ(ann.command(chain)->field(), "spawn.links[0].joint.kind");
  EXPECT_EQ(ann.step(1, true).avatars_size(), 0);
}

TEST_F(Sessions, TheFreeRunningClockTicksByItselfUntilItIsPaused) {
  serve();
  protocol::Client ann = makeClient("ann");
  v1::SetClock clock;
  clock.mutable_free_run()->set_speed(100);
  EXPECT_EQ(ann.setClock(clock).clock().mode(), v1::Clock::MODE_FREE_RUN);
  EXPECT_TRUE(becomesTrue([&] { return ann.metrics().ticks() > 20; }));
  EXPECT_EQ(catchErrorCode([&] { ann.step(); }), v1::ERROR_NOT_ALLOWED);
  clock.mutable_pause();
  const std::uint64_t tick = ann.setClock(clock).tick();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(ann.metrics().ticks(), tick);
  for (const double speed : {-1.0, 1e-300, 1001.0, std::nan("")}) {
    clock.mutable_free_run()->set_speed(speed);
    EXPECT_EQ(catchErrorCode([&] { ann.setClock(clock); }), v1::ERROR_BAD_MESSAGE) << speed;
  }
}

TEST_F(Sessions, MetricsCountTheEvents) {
  serve();
  protocol::Client ann = makeClient("ann"), bob = makeClient("bob");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.01, 0)));
  ann.step(60);
  const v1::Metrics metrics = ann.metrics();
  EXPECT_EQ(metrics.ticks(), 60u);
  EXPECT_EQ(metrics.clients(), 2u);
  EXPECT_EQ(metrics.avatars(), 1u);
  EXPECT_EQ(metrics.contacts(), 1u);
  EXPECT_EQ(metrics.live_contacts(), 1u);
  EXPECT_EQ(metrics.worst_penetration(), 0);
  ASSERT_EQ(metrics.stages_size(), static_cast<int>(scene::kStageCount));
  EXPECT_EQ(metrics.stages(0).name(), "commands");
  EXPECT_GT(metrics.tick().max_us(), 0);
  EXPECT_LE(metrics.tick().median_us(), metrics.tick().max_us());
}

TEST_F(Sessions, EntitiesAreDescribedByNameAndKind) {
  serve();
  protocol::Client ann = makeClient("ann");
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.01, 0)));
  const std::uint32_t id = ann.step(1, true).avatars(0).id();
  const std::vector<std::uint32_t> wanted{kColumn, id, 99};
  const auto entities = ann.describe(wanted);
  ASSERT_EQ(entities.size(), 3u);
  EXPECT_EQ(entities[0].name(), "room_column");
  EXPECT_EQ(entities[0].kind(), v1::Entity::KIND_OBJECT);
  EXPECT_EQ(entities[1].name(), "ann");
  EXPECT_EQ(entities[1].kind(), v1::Entity::KIND_AVATAR);
  EXPECT_EQ(entities[2].kind(), v1::Entity::KIND_UNSPECIFIED);
  EXPECT_EQ(ann.describe({}).size(), 4u);
}

TEST_F(Sessions, AnIfcProductIsDescribedWithItsGlobalIdAndItsOperation) {
  scene::Model model = makeSmallRoom()->model();
  model.objects[kWall - 1].globalId = "2O2Fr$t4X7Zf8NOew3FNtn";
  model.objects[kWall - 1].operationType = "SINGLE_SWING_LEFT";
  serve({}, std::make_shared<const scene::Scene>(std::move(model)));
  const auto entities = makeClient("ann").describe({});
  ASSERT_EQ(entities.size(), 3u);
  EXPECT_EQ(entities[kWall - 1].global_id(), "2O2Fr$t4X7Zf8NOew3FNtn");
  EXPECT_EQ(entities[kWall - 1].operation(), "SINGLE_SWING_LEFT");
  EXPECT_EQ(entities[kFloor - 1].operation(), "");
}

TEST_F(Sessions, EntitiesAreDescribedInPagesOfBoundedSize) {
  ServerLimits limits;
  limits.describedIds = 3;
  limits.replyBytes = 60;  // two of the room's objects
  serve(limits);
  protocol::Client ann = makeClient("ann");
  const auto refusal = [&](std::vector<std::uint32_t> ids) {
    try {
      ann.describe(ids);
    } catch (const protocol::ProtocolError& error) {
      EXPECT_NE(std::string(error.what()).find("in pages"), std::string::npos) << error.what();
      EXPECT_EQ(error.field, "describe.ids");
      return error.code;
    }
    return v1::ERROR_UNSPECIFIED;
  };
  EXPECT_EQ(refusal({99, 99, 99, 99}), v1::ERROR_TOO_LARGE) << "four ids";
  EXPECT_EQ(refusal({99, 99, 99}), v1::ERROR_UNSPECIFIED);
  EXPECT_EQ(refusal({kFloor, kWall, kColumn}), v1::ERROR_TOO_LARGE) << "long names";
  EXPECT_EQ(refusal({}), v1::ERROR_TOO_LARGE) << "everything";
  EXPECT_EQ(refusal({kFloor, kWall}), v1::ERROR_UNSPECIFIED);
}

TEST_F(Sessions, OrdersDroppedByADriveAreReportedWithTagAndReason) {
  serve();
  protocol::Client ann = makeClient("ann");
  ann.subscribe(makeFullSubscription());
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  ann.step(1);
  v1::Command walk = walkTo("ann", 3, 0, 0), wait, drive;
  walk.set_tag(7);
  wait.set_avatar("ann");
  wait.set_tag(8);
  wait.mutable_wait()->set_seconds(1);
  drive.set_avatar("ann");
  drive.set_tag(9);
  drive.mutable_drive()->mutable_velocity()->set_z(1);
  for (const v1::Command& command : {walk, wait, drive}) ASSERT_FALSE(ann.command(command));
  ann.takeEvents();
  ann.step(1);
  ReceivedEvents received;
  received.add(ann.takeEvents());
  std::vector<std::uint64_t> dropped;
  for (const v1::Notice& notice : received.notices) {
    ASSERT_EQ(notice.kind(), v1::Notice::KIND_DROPPED) << notice.text();
    EXPECT_NE(notice.text().find("Drive"), std::string::npos) << notice.text();
    dropped.push_back(notice.tag());
  }
  EXPECT_EQ(dropped, (std::vector<std::uint64_t>{7, 8}));
}

TEST_F(Sessions, MissingEntitiesAreReportedByKind) {
  serve();
  protocol::Client ann = makeClient("ann");
  v1::Command command;
  command.set_avatar("ann");
  command.mutable_drive();
  EXPECT_EQ(ann.command(command)->message(),
            "drive.velocity is missing: give metres per second along x, y and z");
  command.mutable_look();
  EXPECT_EQ(ann.command(command)->message(), "look.at is missing: give a point");
}

TEST_F(Sessions, WelcomeHasEachLimitOfTheServer) {
  ServerLimits limits;
  limits.avatars = 11;
  limits.imageSide = 12;
  limits.ticksPerStep = 13;
  limits.waypoints = 14;
  limits.rays = 15;
  limits.scanRays = 16;
  limits.frameSubscriptions = 17;
  limits.worlds = 18;
  limits.pairs = 19;
  limits.pendingRequests = 20;
  limits.pendingRequestBytes = 21;
  limits.requestsPerSecond = 2200;
  limits.outgoingBytes = 2300'000;
  limits.outgoingFrames = 24;
  limits.connections = 25;
  limits.describedIds = 26;
  limits.helloTimeout = std::chrono::milliseconds(2700);
  limits.messageTimeout = std::chrono::milliseconds(2800);
  serve(limits);
  const v1::Limits sent = makeClient("ann").welcome().limits();
  EXPECT_EQ(sent.max_unread_bytes(), 2300'000u);
  EXPECT_EQ(sent.max_unread_pictures(), 24u);
  EXPECT_EQ(sent.max_connections(), 25u);
  EXPECT_EQ(sent.max_described_ids(), 26u);
  EXPECT_DOUBLE_EQ(sent.hello_seconds(), 2.7);
  EXPECT_DOUBLE_EQ(sent.message_seconds(), 2.8);
  EXPECT_EQ(sent.max_message(), protocol::kServerLimits.total);
  EXPECT_EQ(sent.max_avatars(), 11u);
  EXPECT_EQ(sent.max_picture_width(), 12u);
  EXPECT_EQ(sent.max_picture_height(), 12u);
  EXPECT_EQ(sent.max_ticks_per_step(), 13u);
  EXPECT_EQ(sent.max_waypoints(), 14u);
  EXPECT_EQ(sent.max_rays(), 15u);
  EXPECT_EQ(sent.max_scan_rays(), 16u);
  EXPECT_EQ(sent.max_watches(), 17u);
  EXPECT_EQ(sent.max_worlds(), 18u);
  EXPECT_EQ(sent.max_pairs(), 19u);
  EXPECT_EQ(sent.max_requests_under_way(), 20u);
  EXPECT_EQ(sent.max_bytes_under_way(), 21u);
  EXPECT_EQ(sent.requests_per_second(), 2200u);
}

TEST(Requests, AFloodDoesNotHoldUpTheTicksOfAFreeRunningWorld) {
  FrameService frames(makeSmallRoom());
  QueryService questions(makeSmallRoom());
  TickLoop loop(makeSmallRoom(), frames, questions);
  const auto out = std::make_shared<OutgoingQueue>(OutgoingLimits{std::size_t{1} << 30, 2},
                                                   encodeShared(v1::Bye()), [] {});
  const ClientId ann = loop.join("ann", Role::admin, out, 1);
  v1::ClientMessage request;
  request.set_request_id(2);
  request.mutable_set_clock()->mutable_free_run()->set_speed(1000);
  loop.receive(ann, request, 0);
  request.mutable_describe()->mutable_ids()->Resize(20'000, kWall);
  constexpr int kFlood = tests::kSanitized ? 20 : 60;
  for (int i = 0; i < kFlood; ++i) loop.receive(ann, request, 0);
  request.set_request_id(3);
  request.mutable_metrics();
  loop.receive(ann, request, 0);
  std::optional<v1::Metrics> metrics;
  ASSERT_TRUE(becomesTrue([&] {
    while (const Buffer bytes = out->pop().message.head) {
      protocol::Decoder decoder(protocol::kClientLimits, protocol::Decoder::Expect::messages);
      std::span<const std::uint8_t> rest(*bytes);
      v1::ServerMessage message;
      if (!protocol::parseHeader(decoder.next(rest)->header, message)) return false;
      if (message.reply_to() == 3) metrics = message.metrics();
    }
    return metrics.has_value();
  }));
  EXPECT_GE(metrics->ticks(), 8u) << "not one after each slice";
}

TEST(Requests, AnInternalErrorIsReportedAndTheNextRequestSucceeds) {
  FrameService frames(makeSmallRoom());
  QueryService questions(makeSmallRoom());
  HostedWorld served(makeSmallRoom(), frames, questions);
  bool faulty = true;  // the first message sent throws
  const auto wake = [&] {
    if (std::exchange(faulty, false)) throw std::length_error("too long");
  };
  Client& ann = served.clients[1];
  ann.out = std::make_shared<OutgoingQueue>(OutgoingLimits{1000, 2}, encodeShared(v1::Bye()), wake);
  for (const std::uint64_t id : {1, 2}) {
    v1::ClientMessage describe;
    describe.set_request_id(id);
    describe.mutable_describe()->add_ids(kWall);
    ann.queue.push_back({describe, {}});
  }
  processQueue(served, 1);
  std::vector<v1::ServerMessage> said;
  while (const Buffer bytes = ann.out->pop().message.head) {
    protocol::Decoder decoder(protocol::kClientLimits, protocol::Decoder::Expect::messages);
    std::span<const std::uint8_t> rest(*bytes);
    ASSERT_TRUE(protocol::parseHeader(decoder.next(rest)->header, said.emplace_back()));
  }
  ASSERT_EQ(said.size(), 3u) << "what failed in sending, the error, the second answer";
  EXPECT_EQ(said[1].reply_to(), 1u);
  EXPECT_EQ(said[1].error().code(), v1::ERROR_INTERNAL);
  EXPECT_EQ(said[2].reply_to(), 2u);
  EXPECT_TRUE(said[2].has_names());
}

TEST_F(Sessions, AtShutdownContactsEndAndClientsGetBye) {
  serve();
  protocol::Client ann = makeClient("ann");
  ann.subscribe(makeFullSubscription());
  ASSERT_FALSE(ann.command(spawn("ann", 0, 0.01, 0)));
  ann.step(60);
  ReceivedEvents received;
  received.add(ann.takeEvents());
  std::thread stopping([&] { server_->stop(); });
  bool ended = false;
  while (!ended) {
    const auto message = ann.nextEvent(std::chrono::seconds(10));
    ASSERT_TRUE(message);
    received.add({*message});
    ended = message->has_bye();
    if (ended) {
      EXPECT_EQ(message->bye().code(), v1::ERROR_SHUTTING_DOWN);
    }
  }
  EXPECT_EQ(received.contacts.back().kind(), v1::ContactEvent::KIND_END);
  EXPECT_EQ(received.contacts.back().reason(), v1::ContactEvent::REASON_SHUTDOWN);
  EXPECT_EQ(received.count(v1::ContactEvent::KIND_BEGIN),
            received.count(v1::ContactEvent::KIND_END));
  stopping.join();
}

TEST(Serving, RefusesPublicAddresses) {
  for (const char* address : {"0.0.0.0", "192.0.2.1", "::", "example.invalid"}) {
    EXPECT_THROW(Server(makeSmallRoom(), {address, 0}), ServerError) << address;
  }
}

TEST(Serving, ReportsAPortInUse) {
  const Server first(makeSmallRoom(), {"127.0.0.1", 0});
  try {
    const Server second(makeSmallRoom(), {"127.0.0.1", first.port()});
    FAIL() << "two servers on one port";
  } catch (const ServerError& error) {
    EXPECT_NE(std::string(error.what()).find(std::to_string(first.port())), std::string::npos);
  }
}

}  // namespace
}  // namespace enfilade::server::testing
