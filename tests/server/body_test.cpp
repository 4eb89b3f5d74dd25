// Tests of bodies through a connection: commands, contacts, and positions in images.
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "tests/server/body_room.hpp"
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

class ServedBodies : public ServedRoom {
 protected:
  void SetUp() override { serve({}, makeBodyRoom()); }
};

v1::BodyCommand makeOpening(const std::string& body) {
  v1::BodyCommand command;
  command.set_body(body);
  command.mutable_open();
  return command;
}

/// The event of this kind between these two; null if none was received.
const v1::ContactEvent* findEvent(const ReceivedEvents& received, v1::ContactEvent::Kind kind,
                                  const std::string& a, const std::string& b) {
  for (const v1::ContactEvent& event : received.contacts)
    if (event.kind() == kind && event.a_name() == a && event.b_name() == b) return &event;
  return nullptr;
}

/// The body's state in the last State message that contains it.
std::optional<v1::BodyState> findState(const std::deque<v1::ServerMessage>& messages,
                                       const std::string& body) {
  std::optional<v1::BodyState> found;
  for (const v1::ServerMessage& message : messages)
    for (const v1::BodyState& state : message.state().bodies())
      if (state.name() == body) found = state;
  return found;
}

TEST_F(ServedBodies, WelcomeListsTheBodies) {
  protocol::Client ann = makeClient("ann");
  const auto& bodies = ann.welcome().scene().bodies();
  ASSERT_EQ(bodies.size(), 3);
  EXPECT_EQ(bodies[0].name(), "door");
  EXPECT_EQ(bodies[0].kind(), "hinged");
  EXPECT_EQ(bodies[0].id(), kLeaf);
  EXPECT_EQ(bodies[0].high(), 1.6);
  EXPECT_EQ(bodies[1].kind(), "trigger");
  EXPECT_GT(bodies[2].mass(), 1);
}

TEST_F(ServedBodies, AnUnknownBodyIsRefusedWithTheNearestOne) {
  protocol::Client ann = makeClient("ann");
  const auto refuse = [&](const std::string& name) {
    const auto refused = ann.bodyCommand(makeOpening(name));
    return refused ? refused->message() : "accepted";
  };
  EXPECT_EQ(refuse("dor"), "body: no body named 'dor'; did you mean 'door'?");
  EXPECT_EQ(refuse("rat"), "body: no body named 'rat'; did you mean 'crate'?");
  EXPECT_EQ(refuse("lift"), "body: no body named 'lift'; the bodies are 'door', 'zone', 'crate'");
  v1::Command walk = spawn("ann", 0, 0, 0);
  walk.mutable_walk()->add_opens("dor");
  walk.mutable_walk()->add_along()->set_x(1);
  const auto refused = ann.command(walk);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->message(), "opens[0]: body: no body named 'dor'; did you mean 'door'?");
  EXPECT_EQ(refused->field(), "walk.opens[0]");
}

TEST_F(ServedBodies, AnOpeningDoorPushesAnAvatarAndReportsIt) {
  protocol::Client ann = makeClient("ann"), guest = makeClient("guest");
  guest.subscribe(makeFullSubscription());
  ASSERT_FALSE(ann.command(spawn("ann", 2.6, 0.001, 0.2)));
  ann.step(10);
  ASSERT_FALSE(guest.bodyCommand(makeOpening("door"))) << "a door has no owner";
  ann.step(90);
  guest.metrics();  // all events of the steps arrive before its reply
  const auto messages = guest.takeEvents();
  ReceivedEvents received;
  received.add(messages);
  EXPECT_NE(findEvent(received, v1::ContactEvent::KIND_BEGIN, "ann", "door"), nullptr);
  const auto door = findState(messages, "door");
  ASSERT_TRUE(door);
  EXPECT_EQ(door->id(), kLeaf);
  EXPECT_EQ(door->coordinate(), 1.6);
  EXPECT_EQ(door->blocked_by(), 0u);
  EXPECT_NEAR(door->orientation().y(), std::sin(0.8), 1e-9);
  EXPECT_NEAR(door->orientation().w(), std::cos(0.8), 1e-9);
}

TEST_F(ServedBodies, AnAvatarWithoutRoomBlocksTheDoorAndIsReported) {
  scene::Model model = makeBodyRoomModel();
  const auto add = [&](const char* path, const scene::Vec3& min, const scene::Vec3& max) {
    model.meshes.push_back(scene::testing::buildBoxMesh(min, max));
    model.objects.push_back({path,
                             "",
                             {static_cast<std::uint32_t>(model.meshes.size() - 1)},
                             Eigen::Affine3d::Identity()});
  };
  add("screen", {2.75, 0, -1}, {2.8, 3, 1});
  add("left stop", {2.3, 0, -0.4}, {2.75, 3, -0.25});
  add("right stop", {2.3, 0, 0.45}, {2.75, 3, 0.6});
  serve({}, std::make_shared<const scene::Scene>(model));
  protocol::Client ann = makeClient("ann");
  ann.subscribe(makeFullSubscription());
  ASSERT_FALSE(ann.command(spawn("ann", 2.43, 0.001, 0.1)));
  ann.step(10);
  ASSERT_FALSE(ann.bodyCommand(makeOpening("door")));
  ann.step(120);
  ann.metrics();
  const auto messages = ann.takeEvents();
  ReceivedEvents received;
  received.add(messages);
  const v1::ContactEvent* blocked =
      findEvent(received, v1::ContactEvent::KIND_BLOCKED, "door", "ann");
  const auto door = findState(messages, "door");
  ASSERT_TRUE(door);
  ASSERT_NE(blocked, nullptr) << door->coordinate();
  EXPECT_EQ(blocked->verdict(), v1::VERDICT_SEPARATED);
  EXPECT_EQ(door->blocked_by(), blocked->b());
  EXPECT_LT(door->coordinate(), 1);
  EXPECT_EQ(ann.metrics().worst_penetration(), 0);
}

TEST_F(ServedBodies, AnAvatarThroughATriggerEntersAndLeavesIt) {
  protocol::Client ann = makeClient("ann"), guest = makeClient("guest");
  v1::Subscribe contacts;
  contacts.set_contacts(true);
  guest.subscribe(contacts);
  ASSERT_FALSE(ann.command(spawn("ann", -5, 0.001, 0)));
  ASSERT_FALSE(ann.command(walkTo("ann", -1, 0, 0)));
  ann.step(300);
  guest.metrics();
  ReceivedEvents received;
  received.add(guest.takeEvents());
  const auto* enters = findEvent(received, v1::ContactEvent::KIND_ENTER, "ann", "zone");
  const auto* leaves = findEvent(received, v1::ContactEvent::KIND_LEAVE, "ann", "zone");
  ASSERT_NE(enters, nullptr);
  ASSERT_NE(leaves, nullptr);
  EXPECT_EQ(enters->b(), kZone);
  EXPECT_NE(enters->verdict(), v1::VERDICT_SEPARATED);
  EXPECT_EQ(leaves->verdict(), v1::VERDICT_SEPARATED);
  EXPECT_EQ(leaves->reason(), v1::ContactEvent::REASON_PARTED);
  EXPECT_GT(leaves->tick(), enters->tick() + 30) << "1.6 m at 1.4 m/s";
}

TEST_F(ServedBodies, ABodyThatFallsOutOfTheWorldIsReportedOnce) {
  protocol::Client ann = makeClient("ann");
  ann.subscribe(makeFullSubscription());
  for (int i = 0; i < 4; ++i) ann.step(150);
  ann.metrics();
  ReceivedEvents received;
  received.add(ann.takeEvents());
  ASSERT_EQ(received.count(v1::ContactEvent::KIND_LEFT_WORLD), 1u);
  const auto* left = findEvent(received, v1::ContactEvent::KIND_LEFT_WORLD, "crate", "");
  ASSERT_NE(left, nullptr);
  EXPECT_EQ(left->a(), kCrate);
  EXPECT_EQ(left->b(), 0u);
}

TEST_F(ServedBodies, APictureShowsTheDoorWhereItIs) {
  ENFILADE_NEED_PICTURES(*server_);
  protocol::Client ann = makeClient("ann");
  const auto idsNow = [&] {
    v1::FrameRequest request;
    v1::FreeCamera& camera = *request.mutable_free();
    *camera.mutable_eye() = makeVec(-1, 1.5, 0);
    *camera.mutable_forward() = makeVec(1, 0, 0);
    request.set_width(64);
    request.set_height(64);
    request.add_channels(v1::CHANNEL_IDS);
    const protocol::ReceivedFrame frame = ann.frame(request);
    const auto bytes = frame.plane(v1::CHANNEL_IDS);
    std::vector<std::uint32_t> ids(bytes.size() / 4);
    std::memcpy(ids.data(), bytes.data(), 4 * ids.size());
    return ids;
  };
  constexpr std::size_t middle = 32 * 64 + 32;
  const auto countPixels = [](const std::vector<std::uint32_t>& ids, std::uint32_t id) {
    return std::count(ids.begin(), ids.end(), id);
  };
  ann.step(1);
  const auto shut = idsNow();
  EXPECT_EQ(shut.at(middle), kLeaf);
  EXPECT_EQ(countPixels(shut, kEnd), 0) << "nothing is visible behind the door";
  EXPECT_EQ(countPixels(shut, kZone), 0) << "volumes are not drawn";
  ASSERT_FALSE(ann.bodyCommand(makeOpening("door")));
  ann.step(90);
  const auto open = idsNow();
  EXPECT_EQ(open.at(middle), kEnd);
  EXPECT_GT(countPixels(open, kEnd), 20);
  EXPECT_LT(countPixels(open, kLeaf), countPixels(shut, kLeaf) / 2);
}

TEST_F(ServedBodies, ARayGoesThroughTheDoorWhenItIsOpen) {
  protocol::Client ann = makeClient("ann");
  v1::RayQuery query;
  *query.add_rays()->mutable_origin() = makeVec(-1, 1.5, 0.1);
  *query.mutable_rays(0)->mutable_direction() = makeVec(1, 0, 0);
  ann.step(1);
  EXPECT_EQ(ann.rays(query).hits(0).entity(), kLeaf);
  EXPECT_NEAR(ann.rays(query).hits(0).distance(), 3.02, 1e-6);
  ASSERT_FALSE(ann.bodyCommand(makeOpening("door")));
  ann.step(90);
  EXPECT_EQ(ann.rays(query).hits(0).entity(), kEnd);
}

}  // namespace
}  // namespace enfilade::server::testing
