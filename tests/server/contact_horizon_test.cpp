// Tests of subscriptions to contact horizons through a connection.
#include <map>

#include "tests/server/body_room.hpp"
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

v1::Subscribe toHorizons(std::vector<std::uint32_t> avatars = {}, std::uint32_t approaches = 0) {
  v1::Subscribe subscription;
  v1::ContactHorizonRequest& request = *subscription.mutable_contact_horizon();
  for (const std::uint32_t avatar : avatars) request.add_avatars(avatar);
  request.set_approaches(approaches);
  return subscription;
}

/// The horizons among the received messages, by tick.
std::map<std::uint64_t, std::vector<v1::ContactHorizon>> collectHorizons(
    const std::deque<v1::ServerMessage>& messages) {
  std::map<std::uint64_t, std::vector<v1::ContactHorizon>> horizons;
  for (const v1::ServerMessage& message : messages)
    for (const v1::ContactHorizon& one : message.events().horizons())
      horizons[message.events().tick()].push_back(one);
  return horizons;
}

class ContactHorizons : public ServedRoom {
 protected:
  void SetUp() override {
    ServerOptions options;
    options.world.settings.maxSpeed = 2;  // so that horizons are far ahead
    server_ =
        std::make_unique<Server>(makeBodyRoom(), HostPort{"127.0.0.1", 0}, std::move(options));
  }

  /// The id of an avatar that is in the world.
  static std::uint32_t findId(protocol::Client& client, const std::string& name) {
    const v1::StepReply reply = client.step(1, true);
    for (const v1::AvatarState& avatar : reply.avatars())
      if (avatar.name() == name) return avatar.id();
    ADD_FAILURE() << name;
    return 0;
  }
};

TEST_F(ContactHorizons, AreReportedInTheTicksInWhichTheyChange) {
  protocol::Client ann = makeClient("ann"), bob = makeClient("bob");
  const auto& offers = ann.welcome().capabilities();
  EXPECT_NE(std::find(offers.begin(), offers.end(), "contact_horizon"), offers.end());
  EXPECT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  EXPECT_FALSE(bob.command(spawn("bob", -6, 0.001, 3)));
  ann.step(30);
  const std::uint32_t annId = findId(ann, "ann"), bobId = findId(ann, "bob");
  ann.subscribe(toHorizons({}, 16));
  ann.step(60);
  const auto horizons = collectHorizons(ann.takeEvents());
  ASSERT_FALSE(horizons.empty());
  const auto& [tick, all] = *horizons.begin();
  ASSERT_EQ(all.size(), 2u) << "all of them first";
  EXPECT_EQ(all[0].avatar(), annId);
  EXPECT_EQ(all[1].avatar(), bobId);
  ASSERT_EQ(all[0].touching_size(), 1);
  EXPECT_EQ(all[0].touching(0), 1u) << "the floor";
  EXPECT_EQ(all[0].unbounded(), kCrate);
  EXPECT_GT(all[0].unbounded_distance(), 10);
  ASSERT_GT(all[0].approaches_size(), 1);
  const double now = static_cast<double>(tick) * ann.welcome().policies().tick();
  double last = now;
  for (const auto& approach : all[0].approaches()) {
    EXPECT_GE(approach.not_before(), last);
    last = approach.not_before();
  }
  EXPECT_GT(all[0].approaches(0).not_before(), now + 0.02);
  EXPECT_LT(horizons.size(), 60u) << "not in every tick, although the crate falls";
  std::map<std::uint32_t, std::string> lastReport;  // by avatar
  for (const auto& [reportTick, reports] : horizons) {
    for (const v1::ContactHorizon& report : reports) {
      const std::string text = report.SerializeAsString();
      EXPECT_NE(lastReport[report.avatar()], text) << "unchanged in tick " << reportTick;
      lastReport[report.avatar()] = text;
    }
  }
  bob.metrics();  // what was sent before its reply has arrived then
  EXPECT_TRUE(collectHorizons(bob.takeEvents()).empty()) << "bob did not subscribe";
}

TEST_F(ContactHorizons, NoContactBeginsBeforeThem) {
  protocol::Client ann = makeClient("ann");
  EXPECT_FALSE(ann.command(spawn("ann", -1, 0.001, 0)));
  ann.step(30);
  v1::Subscribe subscription = toHorizons({findId(ann, "ann")}, 16);
  subscription.set_contacts(true);
  ann.subscribe(subscription);
  EXPECT_FALSE(ann.command(walkTo("ann", 1.9, 0, 0)));
  const double tick = ann.welcome().policies().tick();
  std::map<std::uint32_t, double> proved;  // by entity
  int begun = 0, reported = 0;
  for (int i = 0; i < 150; ++i) {
    ann.step();
    for (const v1::ServerMessage& message : ann.takeEvents()) {
      for (const v1::ContactEvent& event : message.events().contacts()) {
        if (event.kind() != v1::ContactEvent::KIND_BEGIN) continue;
        ++begun;
        ASSERT_TRUE(proved.contains(event.b())) << event.b_name();
        EXPECT_GE(event.time(), proved.at(event.b())) << event.b_name();
        EXPECT_LT(event.time() - proved.at(event.b()), 3 * tick) << "and soon after";
      }
      for (const v1::ContactHorizon& horizon : message.events().horizons()) {
        ++reported;
        for (const auto& approach : horizon.approaches())
          proved[approach.entity()] = std::max(proved[approach.entity()], approach.not_before());
      }
    }
  }
  EXPECT_EQ(begun, 1) << "the door";
  EXPECT_GT(reported, 20);
}

TEST_F(ContactHorizons, OneClientGetsItsAvatarAndAnotherAll) {
  protocol::Client ann = makeClient("ann"), bob = makeClient("bob");
  EXPECT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  EXPECT_FALSE(bob.command(spawn("bob", -2, 0.001, 3)));
  ann.step(30);
  const std::uint32_t bobId = findId(ann, "bob");
  ann.subscribe(toHorizons());
  bob.subscribe(toHorizons({bobId}));
  ann.step(3);
  EXPECT_EQ(collectHorizons(ann.takeEvents()).begin()->second.size(), 2u);
  bob.metrics();  // what was sent before its reply has arrived then
  const auto mine = collectHorizons(bob.takeEvents());
  ASSERT_FALSE(mine.empty());
  ASSERT_EQ(mine.begin()->second.size(), 1u);
  EXPECT_EQ(mine.begin()->second[0].avatar(), bobId);
  EXPECT_EQ(mine.begin()->second[0].approaches_size(), 1) << "the default";
  ann.subscribe({});
  ann.step(60);
  EXPECT_TRUE(collectHorizons(ann.takeEvents()).empty());
  bob.metrics();
  for (const auto& [tick, horizons] : collectHorizons(bob.takeEvents()))
    for (const v1::ContactHorizon& one : horizons) EXPECT_EQ(one.avatar(), bobId);
}

TEST_F(ContactHorizons, StartOverAtARestart) {
  protocol::Client ann = makeClient("ann");
  ann.subscribe(toHorizons());
  for (int run = 0; run < 2; ++run) {
    EXPECT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
    ann.step(40);
    const auto horizons = collectHorizons(ann.takeEvents());
    ASSERT_FALSE(horizons.empty());
    EXPECT_EQ(horizons.begin()->first, 1u) << "with the spawn";
    v1::ClientMessage restart;
    restart.mutable_restart();
    ann.request(restart);
  }
}

TEST_F(ContactHorizons, AListOutlivesItsAvatars) {
  protocol::Client ann = makeClient("ann");
  EXPECT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  ann.step(2);
  v1::Subscribe subscription = toHorizons({findId(ann, "ann")});
  ann.subscribe(subscription);
  v1::ClientMessage restart;
  restart.mutable_restart();
  ann.request(restart);
  ann.step(2);
  ann.takeEvents();
  subscription.set_notices(true);  // as a client does that keeps its horizons
  EXPECT_NO_THROW(ann.subscribe(subscription));
  EXPECT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  ann.step(40);
  EXPECT_FALSE(collectHorizons(ann.takeEvents()).empty());
}

TEST_F(ContactHorizons, AreNotSentAgainBySubscribingToOtherEvents) {
  protocol::Client ann = makeClient("ann");
  EXPECT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  ann.step(30);
  v1::Subscribe subscription = toHorizons();
  ann.subscribe(subscription);
  std::string lastReport;
  for (int i = 0; i < 60; ++i) {
    subscription.set_notices(i % 2 == 0);
    ann.subscribe(subscription);
    ann.step(1);
    for (const auto& [tick, reports] : collectHorizons(ann.takeEvents())) {
      EXPECT_NE(reports[0].SerializeAsString(), lastReport) << "tick " << tick;
      lastReport = reports[0].SerializeAsString();
    }
  }
  EXPECT_FALSE(lastReport.empty());
}

TEST_F(ContactHorizons, InvalidRequestsAreRefusedByTheirField) {
  protocol::Client ann = makeClient("ann");
  EXPECT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
  ann.step(2);
  const std::uint32_t id = findId(ann, "ann");
  v1::Subscribe present = toHorizons();
  present.mutable_contact_horizon()->set_assume(v1::CannotTouchQuery::ASSUME_PRESENT_MOTION);
  for (const auto& [subscription, field] : {std::pair{toHorizons({id, 99}), "avatars[1]"},
                                            {toHorizons({1}), "avatars[0]"},
                                            {toHorizons({id, id}), "avatars[1]"},
                                            {toHorizons({}, 17), "approaches"},
                                            {present, "assume"}}) {
    try {
      ann.subscribe(subscription);
      ADD_FAILURE() << field;
    } catch (const protocol::ProtocolError& error) {
      EXPECT_EQ(error.field, std::string("subscribe.contact_horizon.") + field) << error.what();
    }
  }
  ann.step(2);
  EXPECT_TRUE(collectHorizons(ann.takeEvents()).empty());
  v1::Subscribe any = toHorizons({id});
  any.mutable_contact_horizon()->set_assume(v1::CannotTouchQuery::ASSUME_ANY_COMMAND);
  ann.subscribe(any);
  ann.step(1);
  EXPECT_EQ(collectHorizons(ann.takeEvents()).size(), 1u);
}

}  // namespace
}  // namespace enfilade::server::testing
