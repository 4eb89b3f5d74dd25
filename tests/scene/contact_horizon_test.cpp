// Checks on worlds with crowds, doors and lifts that no contact begins before the time that a
// horizon proved, by brute force over all pairs.
#include "scene/world/queries/contact_horizon.hpp"

#include <cmath>

#include "scene/world/queries/proximity_query.hpp"
#include "tests/scene/busy_room.hpp"
#include "tests/scene/world_fixture.hpp"

namespace enfilade::scene::testing {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// All solid entities except dynamic bodies, without the further objects of bodies.
std::vector<EntityId> listBoundedEntities(const World& world) {
  std::vector<EntityId> entities;
  for (const std::uint32_t object : world.scene().solidObjects()) entities.push_back(object + 1);
  for (const BodySnapshot& body : *world.snapshot()->bodies)
    if (isKinematic(world.scene().model().bodies[body.index].kind)) entities.push_back(body.id);
  for (const AvatarSnapshot& avatar : world.snapshot()->avatars) entities.push_back(avatar.id);
  return entities;
}

/// The time that a horizon proves for an entity; nothing is proved for touching ones.
double findProvedTime(const ContactHorizon& horizon, EntityId entity) {
  if (std::ranges::binary_search(horizon.touching, entity)) return 0;
  for (const ContactHorizon::Approach& approach : horizon.approaches)
    if (approach.entity == entity || approach.entity == 0) return approach.notBefore;
  const bool cut = horizon.approaches.size() == ContactHorizon::kMaxApproaches;
  return cut ? horizon.approaches.back().notBefore : kNever;
}

/// Follows a world, and compares each tick with all that was proved before.
class Checker {
 public:
  using Pair = std::pair<EntityId, EntityId>;

  explicit Checker(const World& world, const ContactHorizons::Options& options = {})
      : world_(world),
        index_(borrowScene(world)),
        horizons(borrowScene(world), world.settings(), options) {
    horizons.select(std::nullopt);
  }

  void checkTick(const TickReport& report) {
    horizons.update(world_.snapshot());
    horizons.validate();
    const double now = world_.snapshot()->time;
    for (const ContactEvent& event : report.contacts)
      if (event.kind == ContactEvent::Kind::begin) check({event.a, event.b}, now, "event");
    const std::vector<EntityId> entities = listBoundedEntities(world_);
    for (const AvatarSnapshot& avatar : world_.snapshot()->avatars) {
      const std::set<EntityId> inContact = findContacts(avatar.id);
      for (const EntityId other : entities)
        if (other != avatar.id) lookAt(avatar.id, other, inContact.contains(other), now);
    }
  }

  ContactHorizons& getHorizons() { return horizons; }
  int claims = 0;     ///< of a pair in a tick, beyond the next tick
  int farClaims = 0;  ///< of them, those that are five ticks ahead or more
  int contacts = 0;   ///< begins of contacts of pairs with an earlier claim
  int lasting = 0;    ///< contacts that were listed in the tick before, too
  int pairs = 0;      ///< pairs of all ticks

 private:
  void check(const Pair& pair, double now, const char* what) {
    const auto claim = proved_.find(pair);
    if (claim == proved_.end()) return;
    EXPECT_GE(now, claim->second) << what << ": " << findEntityName(world_, pair.first) << " and "
                                  << findEntityName(world_, pair.second) << " in tick "
                                  << world_.snapshot()->tick;
  }

  /// By brute force over all entities.
  std::set<EntityId> findContacts(EntityId avatar) {
    std::size_t work = kMaxQueryWork;
    const auto near = std::get<NearbyEntities>(findNearbyEntities(
        {index_, *world_.snapshot()}, avatar, computeContactThreshold(world_.settings()), work));
    EXPECT_EQ(near.skipped, 0u);
    std::set<EntityId> found;
    for (const PairProximity& pair : near.pairs) found.insert(pair.b);
    return found;
  }

  void lookAt(EntityId avatar, EntityId other, bool inContact, double now) {
    const Pair pair(avatar, other);
    ++pairs;
    const auto at = horizons.horizons().find(avatar);
    const bool isListed =
        at != horizons.horizons().end() && std::ranges::binary_search(at->second.touching, other);
    const bool wasListed = !(isListed ? listed_.insert(pair).second : listed_.erase(pair) == 0);
    if (inContact) {
      check(pair, now, "distance");
      contacts += proved_.erase(pair) > 0 ? 1 : 0;
      lasting += wasListed ? 1 : 0;
      EXPECT_TRUE(isListed || !wasListed) << "a contact that lasts, tick " << now;
      if (at != horizons.horizons().end() && !isListed) {
        EXPECT_LE(findProvedTime(at->second, other), now) << "a contact that is not listed";
      }
      return;
    }
    if (at == horizons.horizons().end()) return;
    const double proved = findProvedTime(at->second, other);
    if (!(proved > now)) return;
    const double tick = world_.settings().tickDuration;
    claims += proved > now + tick ? 1 : 0;
    farClaims += proved >= now + 5 * tick ? 1 : 0;
    double& claim = proved_[pair];
    claim = std::max(claim, proved);
  }

  const World& world_;
  EntityIndex index_;
  ContactHorizons horizons;
  std::set<Pair> listed_;          ///< in `touching` of the last tick
  std::map<Pair, double> proved_;  ///< the latest time of all ticks since the last contact
};

TEST(ContactHorizon, InABusyRoomNoContactBeginsBeforeItsHorizon) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    BusyRoom room(seed);
    Checker checker(room.world);
    for (int i = 0; i < 400; ++i) {
      if (i % 40 == 5) room.sendRandomCommand();
      if (i % 90 == 30) room.order("guest" + std::to_string(i / 90), Spawn{Vec3(-3, 0.001, 3), 0});
      if (i % 90 == 70) room.order("guest" + std::to_string(i / 90), Leave{});
      checker.checkTick(tickWorld(room.world));
    }
    EXPECT_GT(checker.claims, 5'000) << seed;
    EXPECT_GT(checker.farClaims, 1'000) << seed;
    EXPECT_GT(checker.contacts, 5) << seed;
    EXPECT_EQ(checker.getHorizons().statistics().postponed, 0u);
  }
}

/// A hall with a grid of columns, furniture, doors and two lifts.
Model makeHallOfColumns(int side) {
  const double half = 3.0 * side;
  std::vector<NamedBox> boxes{{"floor", {-half - 1, -0.2, -half - 1}, {half + 1, 0, half + 1}},
                              {"west", {-half - 1, 0, -half}, {-half, 3, half}},
                              {"east", {half, 0, -half}, {half + 1, 3, half}}};
  for (int x = 0; x < side; ++x)
    for (int z = 0; z < side; ++z) {
      const Vec3 at(6.0 * x - half + 3, 0.002, 6.0 * z - half + 3);
      const std::string name = std::to_string(x) + "," + std::to_string(z);
      boxes.push_back({"column " + name, at, at + Vec3(0.3, 3, 0.3)});
      boxes.push_back({"bench " + name, at + Vec3(1.5, 0, 1), at + Vec3(3, 0.45, 1.4)});
      boxes.push_back({"lamp " + name, at + Vec3(-1, 2.5, -1), at + Vec3(-0.7, 2.8, -0.7)});
    }
  const auto first = static_cast<std::uint32_t>(boxes.size());
  boxes.push_back({"leaf", {0.02, 0.01, 0}, {0.08, 2.1, 0.95}});
  boxes.push_back({"car", {-half + 1, 0.01, -half + 1}, {-half + 2.5, 0.1, -half + 2.5}});
  Model model = makeBoxModel(boxes);
  BodySpec door = makeBodySpec("door", BodyKind::hinged, {first});
  door.low = -1.5, door.high = 1.5, door.anchor = {0.05, 0, 0};
  BodySpec lift = makeBodySpec("lift", BodyKind::lift, {first + 1});
  lift.high = 2, lift.stops = {0, 2}, lift.speed = 1;
  model.bodies = {door, lift};
  return model;
}

WorldSettings makeWalkingSettings() {
  WorldSettings settings;
  settings.maxSpeed = 2;
  settings.stepHeight = 0.1;
  return settings;
}

/// Two crowds that walk through each other.
struct TwoCrowds {
  explicit TwoCrowds(int perCrowd, std::uint32_t seed = 7)
      : random(seed),
        run(std::make_shared<const Scene>(makeHallOfColumns(8)), makeWalkingSettings()) {
    for (int i = 0; i < perCrowd; ++i) {
      const double z = 2.0 * (i / 2) - perCrowd, x = 9 + 1.3 * (i % 2);
      run.order("w" + std::to_string(i), Spawn{Vec3(-x, 0.001, z)});
      run.order("e" + std::to_string(i), Spawn{Vec3(x, 0.001, z + 0.2)});
    }
    count = perCrowd;
    run.runTicks(10);
  }
  void turn() {
    const auto aside = [&] { return std::uniform_real_distribution(-0.6, 0.6)(random); };
    for (int i = 0; i < count; ++i) {
      run.order("w" + std::to_string(i), Drive{{1.4, 0, aside()}});
      run.order("e" + std::to_string(i), Drive{{-1.4, 0, aside()}});
    }
    EXPECT_FALSE(submitBodyCommand(run.world, {"door", BodyCommand::Action::open, 0, 0, {}}));
    EXPECT_FALSE(
        submitBodyCommand(run.world, {"lift", BodyCommand::Action::moveToLevel, 0, 1, {}}));
  }

  std::mt19937 random;
  WorldFixture run;
  int count = 0;
};

TEST(ContactHorizon, TwoCrowdsMeetNoEarlierAndFewPairsAreExamined) {
  TwoCrowds crowds(8);
  Checker checker(crowds.run.world);
  for (int i = 0; i < 600; ++i) {
    if (i % 120 == 0) crowds.turn();
    checker.checkTick(crowds.run.step());
  }
  EXPECT_GT(checker.contacts, 20);
  const auto& counts = checker.getHorizons().statistics();
  EXPECT_EQ(counts.postponed, 0u);
  EXPECT_LT(20 * counts.examinations, static_cast<std::uint64_t>(checker.pairs));
  EXPECT_GT(checker.farClaims, 100'000);
  RecordProperty("pairs", checker.pairs);
  RecordProperty("examinations", static_cast<int>(counts.examinations));
}

TEST(ContactHorizon, FewerPairsAreExaminedThanThoseNearTheAvatars) {
  TwoCrowds crowds(12);
  ContactHorizons::Options everything;
  everything.examineAll = true;
  everything.maxWork = 100'000'000;
  ContactHorizons lazy(borrowScene(crowds.run.world), crowds.run.world.settings()),
      eager(borrowScene(crowds.run.world), crowds.run.world.settings(), everything);
  for (ContactHorizons* one : {&lazy, &eager}) one->select(std::nullopt);
  for (int i = 0; i < 300; ++i) {
    if (i % 120 == 0) crowds.turn();
    crowds.run.step();
    for (ContactHorizons* one : {&lazy, &eager}) one->update(crowds.run.world.snapshot());
    for (const auto& [id, horizon] : lazy.horizons())
      EXPECT_EQ(horizon.touching, eager.horizons().at(id).touching) << id << ", " << i;
  }
  EXPECT_LT(3 * lazy.statistics().examinations, eager.statistics().examinations);
}

TEST(ContactHorizon, IsInTheFutureWhereTheWayIsClear) {
  TwoCrowds crowds(4);
  World& world = crowds.run.world;
  EntityIndex index(borrowScene(world));
  ContactHorizons horizons(borrowScene(world), world.settings());
  horizons.select(std::nullopt);
  int clear = 0;
  for (int i = 0; i < 200; ++i) {
    if (i % 100 == 0) crowds.turn();
    crowds.run.step();
    horizons.update(world.snapshot());
    for (const auto& [id, horizon] : horizons.horizons()) {
      std::size_t work = kMaxQueryWork;
      const auto near =
          std::get<NearbyEntities>(findNearbyEntities({index, *world.snapshot()}, id, 0.5, work));
      if (near.pairs.size() > horizon.touching.size()) continue;
      ++clear;
      EXPECT_GT(horizon.notBefore(), world.snapshot()->time);
      EXPECT_TRUE(std::ranges::binary_search(horizon.touching, EntityId{1})) << "the floor";
    }
  }
  EXPECT_GT(clear, 200);
}

TEST(ContactHorizon, WithoutEnoughWorkItIsEarlierAndNeverWrong) {
  ContactHorizons::Options little;
  little.maxWork = 300;
  TwoCrowds crowds(6);
  Checker checker(crowds.run.world, little);
  for (int i = 0; i < 300; ++i) {
    if (i % 120 == 0) crowds.turn();
    checker.checkTick(crowds.run.step());
  }
  EXPECT_GT(checker.getHorizons().statistics().postponed, 100u);
  EXPECT_GT(checker.claims, 1'000);
  EXPECT_GE(checker.contacts, 5);
  EXPECT_GT(checker.lasting, 1'000);
}

/// Without steps and jumps an avatar's bound is twice the speed limit.
WorldSettings makeFlatSettings(double maxSpeed) {
  WorldSettings settings;
  settings.maxSpeed = maxSpeed;
  settings.stepHeight = 0;
  settings.maxJumpHeight = 0;
  settings.contactOffset = 1e-5;
  return settings;
}

TEST(ContactHorizon, AtTheSpeedLimitAHorizonIsHalfOfTheTrueTime) {
  WorldFixture run({makeFloorBox(), {"wall", {5, 0.001, -4}, {5.2, 3, 4}}}, makeFlatSettings(4));
  run.order("ann", Spawn{Vec3(-6, 0.001, 0)});
  run.order("bob", Spawn{Vec3(0, 0.001, 0)});
  run.runTicks(20);
  Checker checker(run.world);
  run.order("ann", Drive{{4, 0, 0}});
  run.order("bob", Drive{{-4, 0, 0}});
  checker.checkTick(run.step());
  const EntityId ann = run.getView("ann").id, bob = run.getView("bob").id;
  const double start = run.world.snapshot()->time;
  const ContactHorizon& first = checker.getHorizons().horizons().at(ann);
  ASSERT_EQ(first.approaches[0].entity, bob);
  const double proved = first.notBefore() - start;
  while (!run.open.contains({ann, bob}) && run.world.snapshot()->time < start + 5)
    checker.checkTick(run.step());
  const double taken = run.world.snapshot()->time - start;
  EXPECT_GT(proved, 0.45 * taken - 0.02);
  EXPECT_EQ(checker.contacts, 2) << "each of the other";
}

TEST(ContactHorizon, ABodyPushesAnAvatarFasterThanItsSpeedLimit) {
  Model model = makeBoxModel(
      {makeFloorBox(), {"ram", {-3, 0.01, -1}, {-2, 2, 1}}, {"wall", {2, 0.001, -4}, {2.2, 3, 4}}});
  BodySpec ram = makeBodySpec("ram", BodyKind::sliding, {1});
  ram.axis = {1, 0, 0};
  ram.high = 3.6;
  ram.speed = 5;
  model.bodies = {ram};
  BodyFixture t(std::move(model), makeFlatSettings(0.5));
  t.order("ann", Spawn{Vec3(0, 0.001, 0)});
  t.runTicks(20);
  Checker checker(t.world);
  t.submit({"ram", BodyCommand::Action::moveTo, 3.6, 0, {}});
  for (int i = 0; i < 120; ++i) checker.checkTick(t.step());
  EXPECT_GT(t.getFeet("ann").x(), 1.4) << "it was pushed";
  EXPECT_GT(checker.farClaims, 5);
  EXPECT_EQ(checker.contacts, 2) << "of the ram and of the wall";
}

TEST(ContactHorizon, AnAvatarThatStandsUpWasExpectedTo) {
  WorldSettings settings = makeFlatSettings(1);
  settings.contactOffset = 0.5e-3;
  WorldFixture run({makeFloorBox(), {"beam", {-1, 1.7513, -1}, {1, 2, 1}}}, settings);
  run.order("ann", Spawn{Vec3(-3, 0.001, 0)});
  run.order("ann", Crouch{0.9});
  run.order("ann", makeWalkTo(0, 0, 1));
  run.runTicks(240);
  ASSERT_LT(run.getView("ann").height, 1);
  Checker checker(run.world);
  for (int i = 0; i < 10; ++i) checker.checkTick(run.step());
  run.order("ann", Crouch{});
  for (int i = 0; i < 10; ++i) checker.checkTick(run.step());
  EXPECT_TRUE(run.hasTouched("beam"));
}

TEST(ContactHorizon, ADistantAvatarIsOneSimpleQuotient) {
  WorldFixture run({{"floor", {-50, -0.2, -50}, {50, 0, 50}}}, makeWalkingSettings());
  run.order("ann", Spawn{Vec3(0, 0.001, 0)});
  run.order("bob", Spawn{Vec3(5.6, 0.001, 0)});
  run.runTicks(20);
  ContactHorizons horizons(borrowScene(run.world), run.world.settings());
  const EntityId ann = run.getView("ann").id, bob = run.getView("bob").id;
  horizons.select(std::set{ann});
  horizons.update(run.world.snapshot());
  ASSERT_EQ(horizons.horizons().size(), 1u);
  const ContactHorizon& horizon = horizons.horizons().at(ann);
  EXPECT_EQ(horizon.touching, std::vector<EntityId>{1});
  EXPECT_EQ(horizon.unbounded.entity, 0u);
  ASSERT_FALSE(horizon.approaches.empty());
  EXPECT_EQ(horizon.approaches[0].entity, bob);
  const double speed = 2 * computeAvatarSpeedLimit(run.getView("ann"), run.world.settings());
  EXPECT_NEAR(horizon.notBefore() - run.world.snapshot()->time, (5 - 0.001) / speed, 0.01);
}

TEST(ContactHorizon, NewAvatarsAreIncludedAndLeftOnesAreNot) {
  WorldFixture run({makeFloorBox()}, makeWalkingSettings());
  run.order("ann", Spawn{Vec3(0, 0.001, 0)});
  run.runTicks(20);
  ContactHorizons horizons(borrowScene(run.world), run.world.settings());
  const EntityId ann = run.getView("ann").id;
  horizons.select(std::set{ann});  // without the new one
  horizons.update(run.world.snapshot());
  run.step();
  horizons.update(run.world.snapshot());
  for (const auto& approach : horizons.horizons().at(ann).approaches)
    EXPECT_EQ(approach.entity, 0u) << "nothing but the floor is there";
  run.order("bob", Spawn{Vec3(0.8, 0.001, 0)});
  run.step();
  horizons.update(run.world.snapshot());
  ASSERT_FALSE(horizons.horizons().at(ann).approaches.empty());
  EXPECT_EQ(horizons.horizons().at(ann).approaches[0].entity, run.getView("bob").id);
  EXPECT_EQ(horizons.horizons().at(ann).changedTick, run.world.snapshot()->tick);
  run.order("bob", Leave{});
  run.step();
  horizons.update(run.world.snapshot());
  EXPECT_EQ(horizons.horizons().size(), 1u);
  for (const auto& approach : horizons.horizons().at(ann).approaches)
    EXPECT_EQ(approach.entity, 0u);
}

TEST(ContactHorizon, RestingAvatarsCostNoExamination) {
  WorldFixture run({makeFloorBox(), {"wall", {1, 0.01, -2}, {1.2, 3, 2}}}, makeWalkingSettings());
  run.order("ann", Spawn{Vec3(0, 0.001, 0)});
  run.order("bob", Spawn{Vec3(0, 0.001, 0.7)});
  run.runTicks(30);
  ContactHorizons horizons(borrowScene(run.world), run.world.settings());
  horizons.select(std::nullopt);
  std::uint64_t first = 0;
  for (int i = 0; i < 130; ++i) {
    if (i == 30) first = horizons.statistics().examinations;
    run.step();
    horizons.update(run.world.snapshot());
    for (const auto& [id, horizon] : horizons.horizons())
      EXPECT_GT(horizon.notBefore(), run.world.snapshot()->time);
  }
  EXPECT_EQ(first, 5u) << "two floors, two walls, and the two avatars once";
  EXPECT_EQ(horizons.statistics().examinations, first);
}

TEST(ContactHorizon, NamesTheNearestDynamicBodyAndProvesNothingOfIt) {
  Model model = makeBoxModel({makeFloorBox(),
                              {"near", {2, 0.001, -0.5}, {3, 1, 0.5}},
                              {"far", {-6, 0.001, -0.5}, {-5, 1, 0.5}}});
  model.bodies = {makeBodySpec("near", BodyKind::rigid, {1}),
                  makeBodySpec("far", BodyKind::rigid, {2})};
  BodyFixture t(std::move(model), makeWalkingSettings());
  t.order("ann", Spawn{Vec3(0, 0.001, 0)});
  t.runTicks(20);
  ContactHorizons horizons(borrowScene(t.world), t.world.settings());
  horizons.select(std::nullopt);
  horizons.update(t.world.snapshot());
  ASSERT_EQ(horizons.horizons().size(), 1u);
  const ContactHorizon& horizon = horizons.horizons().begin()->second;
  EXPECT_EQ(horizon.unbounded.entity, 2u);
  EXPECT_GE(horizon.unbounded.gap, 1.7 * 7 / 8 - 0.02);
  EXPECT_LE(horizon.unbounded.gap, 1.7 + 1e-6);
  for (const auto& approach : horizon.approaches) EXPECT_EQ(approach.entity, 0u);
}

TEST(ContactHorizon, StartsOverAfterAGapOfTicksAndForOtherAvatars) {
  TwoCrowds crowds(3);
  World& world = crowds.run.world;
  ContactHorizons horizons(borrowScene(world), world.settings());
  horizons.select(std::nullopt);
  horizons.update(world.snapshot());
  EXPECT_GE(horizons.horizons().size(), 4u);
  crowds.turn();
  crowds.run.runTicks(200);
  horizons.update(world.snapshot());
  ContactHorizons fresh(borrowScene(world), world.settings());
  fresh.select(std::nullopt);
  fresh.update(world.snapshot());
  for (const auto& [id, horizon] : fresh.horizons()) {
    EXPECT_EQ(horizons.horizons().at(id).notBefore(), horizon.notBefore());
    EXPECT_EQ(horizons.horizons().at(id).touching, horizon.touching);
  }
  const EntityId one = world.snapshot()->avatars[2].id;
  horizons.select(std::set{one, EntityId{999'999}});
  crowds.run.step();
  horizons.update(world.snapshot());
  horizons.validate();
  ASSERT_EQ(horizons.horizons().size(), 1u);
  EXPECT_EQ(horizons.horizons().begin()->first, one);
  horizons.reset();
  EXPECT_TRUE(horizons.horizons().empty());
  horizons.update(world.snapshot());
  EXPECT_EQ(horizons.horizons().size(), 1u);
}

}  // namespace
}  // namespace enfilade::scene::testing
