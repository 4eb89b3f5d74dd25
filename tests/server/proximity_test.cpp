// Tests of pair queries through a connection: distances, contacts, and lower bounds on the time to
// contact.
#include <cmath>
#include <limits>

#include "tests/server/body_room.hpp"
#include "tests/server/served_room.hpp"

namespace enfilade::server::testing {
namespace {

constexpr std::uint32_t kRoomFloor = 1;

v1::EntityRef makeEntityRef(std::uint32_t id) {
  v1::EntityRef ref;
  ref.set_id(id);
  return ref;
}

v1::EntityRef makeEntityRef(const std::string& name) {
  v1::EntityRef ref;
  ref.set_name(name);
  return ref;
}

template <class A, class B>
v1::DistanceQuery makeDistanceQuery(const A& a, const B& b) {
  v1::DistanceQuery query;
  v1::DistanceQuery::Pair& pair = *query.add_pairs();
  *pair.mutable_a() = makeEntityRef(a);
  *pair.mutable_b() = makeEntityRef(b);
  return query;
}

template <class A>
v1::TouchingQuery makeTouchingQuery(const A& which, double within) {
  v1::TouchingQuery query;
  *query.mutable_entity() = makeEntityRef(which);
  query.set_within(within);
  return query;
}

v1::CannotTouchQuery makeCannotTouchQuery(const std::string& a, const std::string& b,
                                          double minWait = 0) {
  v1::CannotTouchQuery query;
  *query.mutable_a() = makeEntityRef(a);
  *query.mutable_b() = makeEntityRef(b);
  query.set_least(minWait);
  return query;
}

class Pairs : public ServedRoom {
 protected:
  void SetUp() override { serve({}, makeBodyRoom()); }

  /// A client whose avatar "ann" stands at x = 0, 2 m before the door's wall.
  protocol::Client enterTheRoom() {
    protocol::Client ann = makeClient("ann");
    EXPECT_FALSE(ann.command(spawn("ann", 0, 0.001, 0)));
    ann.step(30);
    return ann;
  }
};

template <class Ask>
protocol::ProtocolError catchRefusal(const Ask& ask) {
  try {
    ask();
  } catch (const protocol::ProtocolError& error) {
    return error;
  }
  ADD_FAILURE() << "it was answered";
  return {v1::ERROR_UNSPECIFIED, "answered"};
}

TEST_F(Pairs, DistancesAreThoseThatWereBuiltByIdAndByName) {
  protocol::Client ann = enterTheRoom();
  v1::DistanceQuery query = makeDistanceQuery("left", "end");
  *query.add_pairs() = makeDistanceQuery("ann", "left").pairs(0);
  *query.add_pairs() = makeDistanceQuery(kLeaf, kRoomFloor).pairs(0);
  *query.add_pairs() = makeDistanceQuery("left", "floor").pairs(0);
  const v1::DistanceReply reply = ann.distances(query);
  ASSERT_EQ(reply.pairs_size(), 4);
  EXPECT_EQ(reply.tick(), 30u);
  EXPECT_NEAR(reply.pairs(0).distance(), 3.9, 1e-6) << "floats in the file";
  EXPECT_EQ(reply.pairs(0).verdict(), v1::VERDICT_SEPARATED);
  EXPECT_NEAR(reply.pairs(0).normal().x(), 1, 1e-12);
  EXPECT_NEAR(reply.pairs(1).distance(), std::hypot(2, 0.6) - 0.3, 0.02);
  EXPECT_EQ(reply.pairs(1).a_name(), "ann");
  EXPECT_EQ(reply.pairs(2).a_name(), "door") << "a body goes by its own name";
  EXPECT_NEAR(reply.pairs(2).distance(), 0.01, 1e-6);
  EXPECT_EQ(reply.pairs(3).verdict(), v1::VERDICT_TOUCHING);
}

TEST_F(Pairs, RefinedPairsHaveTheDepth) {
  const auto block =
      scene::testing::makeBoxModel({{"a", {0, 0, 0}, {1, 1, 1}}, {"b", {0.75, 0, 0}, {2, 1, 1}}});
  serve({}, std::make_shared<const scene::Scene>(block));
  protocol::Client ann = makeClient("ann");
  v1::DistanceQuery query = makeDistanceQuery("a", "b");
  EXPECT_EQ(ann.distances(query).pairs(0).penetration(), 0);
  query.set_refined(true);
  const v1::PairState state = ann.distances(query).pairs(0);
  EXPECT_EQ(state.verdict(), v1::VERDICT_PENETRATING);
  EXPECT_EQ(state.penetration(), 0.25);
}

TEST_F(Pairs, TouchingEntitiesAreSortedByDistance) {
  protocol::Client ann = enterTheRoom();
  const v1::TouchingReply touching = ann.touching(makeTouchingQuery("left", 0));
  ASSERT_EQ(touching.found_size(), 1);
  EXPECT_EQ(touching.found(0).b_name(), "floor");
  const v1::TouchingReply around = ann.touching(makeTouchingQuery("ann", 2.5));
  std::vector<std::string> names;
  for (const v1::PairState& one : around.found()) names.push_back(one.b_name());
  EXPECT_EQ(names, (std::vector<std::string>{"floor", "door", "left", "right"}));
  EXPECT_EQ(around.left_out(), 0u);
}

TEST_F(Pairs, TheMountingOfALiftIsListed) {
  scene::Model model = scene::testing::makeBoxModel({{"floor", {-5, -0.2, -5}, {5, 0, 5}},
                                                     {"car", {-1, 0, -1}, {1, 0.2, 1}},
                                                     {"beam", {0.5, 2, -1}, {3, 2.2, 1}}});
  scene::BodySpec lift;
  lift.name = "lift";
  lift.kind = scene::BodyKind::lift;
  lift.objects = {1};
  lift.high = 3, lift.stops = {0, 3};
  model.bodies = {lift};
  serve({}, std::make_shared<const scene::Scene>(std::move(model)));
  protocol::Client ann = makeClient("ann");
  const v1::TouchingReply ofLift = ann.touching(makeTouchingQuery("lift", 0));
  ASSERT_EQ(ofLift.mounting_size(), 1);
  EXPECT_EQ(ofLift.mounting(0), 1u);
  EXPECT_EQ(ofLift.found_size(), 1) << "it is reported when requested";
  EXPECT_EQ(ann.touching(makeTouchingQuery("beam", 0)).mounting_size(), 0);
}

TEST_F(Pairs, EntitiesBeyondOneReplyAreCounted) {
  ServerLimits limits;
  limits.replyBytes = 400;  // two pairs
  serve(limits, makeBodyRoom());
  protocol::Client ann = enterTheRoom();
  const v1::TouchingReply around = ann.touching(makeTouchingQuery("ann", 2.5));
  EXPECT_EQ(around.found_size() + static_cast<int>(around.left_out()), 4);
  EXPECT_GT(around.left_out(), 0u);
  EXPECT_EQ(around.found(0).b_name(), "floor");
}

TEST_F(Pairs, AnAvatarTouchesTheWallAtTheReportedTime) {
  protocol::Client ann = enterTheRoom();
  v1::Command drive;
  drive.set_avatar("ann");
  *drive.mutable_drive()->mutable_velocity() = makeVec(2, 0, -1);
  ASSERT_FALSE(ann.command(drive));
  ann.step(1);
  const v1::CannotTouchReply said = ann.cannotTouch(makeCannotTouchQuery("ann", "left"));
  EXPECT_FALSE(said.never());
  EXPECT_TRUE(said.proved());
  EXPECT_GT(said.before(), 0);
  EXPECT_EQ(said.look_again(), said.before());
  EXPECT_TRUE(ann.cannotTouch(makeCannotTouchQuery("left", "end")).never());
  EXPECT_EQ(ann.cannotTouch(makeCannotTouchQuery("left", "end", 2)).look_again(), 2);
  EXPECT_EQ(ann.cannotTouch(makeCannotTouchQuery("left", "floor")).before(), 0) << "they touch";
  const v1::CannotTouchReply later = ann.cannotTouch(makeCannotTouchQuery("ann", "left", 3000));
  EXPECT_EQ(later.look_again(), 3000);
  EXPECT_FALSE(later.proved());
  v1::CannotTouchQuery any = makeCannotTouchQuery("ann", "left");
  any.set_assume(v1::CannotTouchQuery::ASSUME_ANY_COMMAND);
  EXPECT_LT(ann.cannotTouch(any).before(), said.before());
  EXPECT_GT(ann.cannotTouch(any).before(), 0);
  any = makeCannotTouchQuery("crate", "floor");
  any.set_assume(v1::CannotTouchQuery::ASSUME_ANY_COMMAND);
  EXPECT_EQ(ann.cannotTouch(any).before(), 0) << "of free bodies nothing is known";
}

TEST_F(Pairs, InvalidQueriesAreRefusedByTheirField) {
  ServerLimits limits;
  limits.pairs = 2;
  serve(limits, makeBodyRoom());
  protocol::Client ann = enterTheRoom();
  const auto distance = [&](const v1::DistanceQuery& query) {
    return catchRefusal([&] { ann.distances(query); });
  };
  const auto expect = [](const protocol::ProtocolError& error, v1::ErrorCode code,
                         const std::string& field) {
    EXPECT_EQ(error.code, code) << error.what();
    EXPECT_EQ(error.field, field) << error.what();
  };
  expect(distance({}), v1::ERROR_BAD_MESSAGE, "distances.pairs");
  expect(distance(makeDistanceQuery("window", "floor")), v1::ERROR_UNKNOWN_ENTITY,
         "distances.pairs[0].a");
  expect(distance(makeDistanceQuery("floor", 0u)), v1::ERROR_UNKNOWN_ENTITY,
         "distances.pairs[0].b");
  expect(distance(makeDistanceQuery("floor", kRoomFloor)), v1::ERROR_BAD_MESSAGE,
         "distances.pairs[0].b");
  v1::DistanceQuery query = makeDistanceQuery("floor", "left");
  query.mutable_pairs(0)->clear_b();
  expect(distance(query), v1::ERROR_BAD_MESSAGE, "distances.pairs[0].b");
  query = makeDistanceQuery("floor", "left");
  for (int i = 0; i < 2; ++i) *query.add_pairs() = query.pairs(0);
  expect(distance(query), v1::ERROR_TOO_LARGE, "distances.pairs");
  query = makeDistanceQuery("floor", "left");
  query.set_tick(7);
  expect(distance(query), v1::ERROR_TICK_GONE, "distances.tick");
  for (const double within : {-1.0, std::nan(""), 1001.0, std::numeric_limits<double>::infinity()})
    expect(catchRefusal([&] { ann.touching(makeTouchingQuery("ann", within)); }),
           v1::ERROR_BAD_MESSAGE, "touching.within");
  for (const double minWait : {-1.0, std::nan(""), 3601.0})
    expect(catchRefusal([&] { ann.cannotTouch(makeCannotTouchQuery("ann", "left", minWait)); }),
           v1::ERROR_BAD_MESSAGE, "cannot_touch.least");
  EXPECT_EQ(ann.distances(makeDistanceQuery("left", "end")).pairs_size(), 1)
      << "the connection continues";
}

TEST_F(Pairs, AnAvatarThatLeftIsUnknown) {
  protocol::Client ann = enterTheRoom();
  const std::uint32_t id = ann.distances(makeDistanceQuery("ann", "floor")).pairs(0).a();
  v1::Command leave;
  leave.set_avatar("ann");
  leave.mutable_leave();
  ASSERT_FALSE(ann.command(leave));
  ann.step(2);
  for (const v1::DistanceQuery& query :
       {makeDistanceQuery("ann", "floor"), makeDistanceQuery(id, "floor")}) {
    const auto refusal = catchRefusal([&] { ann.distances(query); });
    EXPECT_EQ(refusal.code, v1::ERROR_UNKNOWN_ENTITY);
  }
}

TEST_F(Pairs, TheWelcomeHasTheLimits) {
  ServerLimits limits;
  limits.pairs = 7;
  limits.pendingRequests = 8;
  limits.pendingRequestBytes = 9000;
  limits.requestsPerSecond = 10'000;
  serve(limits);
  const v1::Limits sent = makeClient("ann").welcome().limits();
  EXPECT_EQ(sent.max_pairs(), 7u);
  EXPECT_EQ(sent.max_requests_under_way(), 8u);
  EXPECT_EQ(sent.max_bytes_under_way(), 9000u);
  EXPECT_EQ(sent.requests_per_second(), 10'000u);
}

}  // namespace
}  // namespace enfilade::server::testing
