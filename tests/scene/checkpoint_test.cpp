#include "scene/world/checkpoint/checkpoint.hpp"

#include <functional>
#include <iterator>

#include "tests/scene/body_fixture.hpp"
#include "tests/scene/checkpoint_fixture.hpp"
#include "tests/scene/world_fixture.hpp"
#include "tests/support/sanitized.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;

/// A room with all moving things: doors that avatars open and that close again, a lift, a step. A
/// tray that shakes boxes, a tower of boxes, a trigger.
std::shared_ptr<const Scene> makeLivelyRoom() {
  std::vector<NamedBox> boxes{makeFloorBox(),
                              {"north", {-10, 0, -10.2}, {10, 3, -10}},
                              {"south", {-10, 0, 10}, {10, 3, 10.2}},
                              {"west", {-10.2, 0, -10}, {-10, 3, 10}},
                              {"east", {10, 0, -10}, {10.2, 3, 10}},
                              {"step", {-9, 0, -2}, {-6, 0.25, 2}},
                              {"low", {2, 1.3, -9}, {5, 1.5, -6}},
                              {"hinged", {0, 0.01, 0}, {0.9, 2, 0.05}},
                              {"sliding", {3, 0.01, 0}, {4, 2, 0.05}},
                              {"lift", {-4, -0.1, 4}, {-2, 0.05, 6}},
                              {"tray", {5, 0.5, 5}, {7, 0.6, 7}},
                              {"trigger", {-3, 0, -6}, {3, 2, -3}}};
  const auto firstFree = static_cast<std::uint32_t>(boxes.size());
  for (int i = 0; i < 4; ++i) {
    const double low = 0.001 + 0.301 * i;
    boxes.push_back({"tower" + std::to_string(i), {-2, low, -1}, {-1.7, low + 0.3, -0.7}});
  }
  for (int i = 0; i < 6; ++i)
    boxes.push_back({"shaken" + std::to_string(i),
                     {5.3 + 0.2 * (i % 3), 0.65 + 0.2 * (i / 3), 6},
                     {5.45 + 0.2 * (i % 3), 0.8 + 0.2 * (i / 3), 6.15}});
  Model model = makeBoxModel(boxes);
  BodySpec hinged = makeBodySpec("hinged", BodyKind::hinged, {7});
  hinged.low = -1.5, hinged.high = 1.5, hinged.autoCloseDelay = 0.5, hinged.speed = 2;
  hinged.openedBy = OpenedBy::touch;
  BodySpec sliding = makeBodySpec("sliding", BodyKind::sliding, {8});
  sliding.anchor = {3, 0, 0}, sliding.axis = Vec3::UnitX(), sliding.high = 0.9;
  sliding.acceleration = 2;
  BodySpec lift = makeBodySpec("lift", BodyKind::lift, {9});
  lift.anchor = {-3, 0, 5}, lift.high = 2, lift.stops = {0, 1, 2}, lift.speed = 1.5;
  BodySpec tray = makeBodySpec("tray", BodyKind::path, {10});
  tray.anchor = {6, 0.5, 6}, tray.loops = true;
  tray.keys = {{0, Vec3::Zero(), 0},
               {0.1, {0, 0.02, 0.01}, 0},
               {0.3, Vec3::Zero(), 0},
               {0.5, Vec3::Zero(), 0}};
  model.bodies = {hinged, sliding, lift, tray, makeBodySpec("trigger", BodyKind::trigger, {11})};
  for (std::uint32_t i = firstFree; i < boxes.size(); ++i)
    model.bodies.push_back(makeBodySpec(boxes[i].path, BodyKind::rigid, {i}));
  return std::make_shared<const Scene>(std::move(model));
}

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  double drawUniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1p-53);
  }
  std::size_t drawBelow(std::size_t count) { return random_() % count; }

 private:
  std::mt19937_64 random_;
};

Spawn makeSpawn(std::size_t kind, Random& random) {
  Spawn spawn;
  spawn.position = {random.drawUniform(-8, 8), 0.3, random.drawUniform(-8, 8)};
  spawn.facing = random.drawUniform(0, 360);
  if (kind == 1)
    spawn.parts = {makeBoxPoints({-0.2, 0, -0.3}, {0.2, 0.9, 0.3}),
                   makeBoxPoints({-0.1, 0.9, -0.1}, {0.1, 1.2, 0.1})};
  if (kind == 2) {
    spawn.links = {{-1,
                    {LinkJoint::Kind::revolute, {0, 1.8, 0}, {0, 1, 0}, -3, 3},
                    makeBoxPoints({0, 0, -0.05}, {0.8, 0.1, 0.05}),
                    0.3},
                   {0,
                    {LinkJoint::Kind::prismatic, {0.8, 0, 0}, {1, 0, 0}, 0, 0.3},
                    makeBoxPoints({0, 0, -0.1}, {0.1, 0.1, 0.1}),
                    0}};
    spawn.selfContact = true;
  }
  spawn.flying = kind == 3;
  return spawn;
}

Order makeOrder(std::size_t kind, Random& random) {
  const Vec3 there{random.drawUniform(-9, 9), 0, random.drawUniform(-9, 9)};
  switch (random.drawBelow(9)) {
    case 0:
      return Walk{{there, Vec3(-there)},
                  random.drawUniform(0.5, 3),
                  {"hinged"},
                  {{1, "lift", 1}},
                  random.drawBelow(2)};
    case 1:
      return Jump{random.drawUniform(0.1, 0.6), {}};
    case 2:
      return Crouch{kind == 0 ? random.drawUniform(0.8, 1.75) : 0};
    case 3:
      return Look{there};
    case 4:
      return Wait{random.drawUniform(0, 0.5)};
    case 5:
      return DriveJoints{
          {random.drawUniform(-2, 2), random.drawUniform(0, 0.3)}, 2, random.drawBelow(2) == 0};
    case 6:
      return random.drawBelow(4) == 0 ? Order(Leave{}) : Order(Fly{random.drawBelow(2) == 0});
    default:
      return Drive{{random.drawUniform(-3, 3), 0, random.drawUniform(-3, 3)}};
  }
}

std::map<std::uint64_t, TickCommands> makeRoomCommands(unsigned seed, std::uint64_t until) {
  constexpr std::size_t kAvatars = 12;
  Random random(seed);
  std::map<std::uint64_t, TickCommands> commands;
  const auto makeName = [](std::size_t i) { return "a" + std::to_string(i); };
  std::uint64_t tag = 0;
  for (std::size_t i = 0; i < kAvatars; ++i)
    commands[1].avatars.push_back({makeName(i), makeSpawn(i % 4, random), ++tag});
  for (std::uint64_t t = 2; t < until; ++t) {
    const std::size_t who = random.drawBelow(kAvatars);
    if (random.drawBelow(3) == 0)
      commands[t].avatars.push_back({makeName(who), makeOrder(who % 4, random), ++tag});
    if (random.drawBelow(60) == 0)
      commands[t].avatars.push_back({makeName(who), makeSpawn(who % 4, random), ++tag});
    if (random.drawBelow(40) != 0) continue;
    BodyCommand command;
    command.body = std::array{"hinged", "sliding", "lift", "tray"}[random.drawBelow(4)];
    if (command.body == "lift") {
      command.action = BodyCommand::Action::moveToLevel;
      command.level = static_cast<std::uint32_t>(random.drawBelow(3));
    } else if (command.body == "tray") {
      command.action = random.drawBelow(2) ? BodyCommand::Action::run : BodyCommand::Action::stop;
    } else {
      command.action = random.drawBelow(2) ? BodyCommand::Action::open : BodyCommand::Action::close;
    }
    commands[t].bodies.push_back(command);
  }
  return commands;
}

WorldSettings makeWatchfulSettings() {
  WorldSettings settings;
  settings.nearMissDistance = 0.1;
  return settings;
}

TEST(Checkpoint, ACopyFromAnyTickOfABusyRoomIsBitEqual) {
  const auto scene = makeLivelyRoom();
  constexpr unsigned kRooms = tests::kSanitized ? 1 : 4;
  for (unsigned seed = 1; seed <= kRooms; ++seed) {
    constexpr std::uint64_t kUntil = 800;
    Random random(100 + seed);
    std::vector<std::uint64_t> at{0, 1};
    for (int i = 0; i < 8; ++i) at.push_back(2 + random.drawBelow(kUntil - 300));
    compareCopies(scene, makeWatchfulSettings(), makeRoomCommands(seed, kUntil), kUntil, at, 300);
    if (HasFatalFailure()) FAIL() << "seed " << seed;
  }
}

/// The lively room after some ticks, with motions and contacts in progress.
World makeLivelyWorld(std::uint64_t ticks = 200) {
  World world(makeLivelyRoom(), makeWatchfulSettings());
  const auto commands = makeRoomCommands(7, ticks);
  for (std::uint64_t t = 1; t <= ticks; ++t) {
    if (const auto now = commands.find(t); now != commands.end()) give(world, now->second);
    tickWorld(world);
  }
  return world;
}

TEST(Checkpoint, ACrowdUsesLessThanFourKilobytesPerAvatar) {
  WorldFixture run({makeFloorBox()});
  for (int i = 0; i < 40; ++i)
    run.order("a" + std::to_string(i), Spawn{{-8.0 + (i % 8), 0, -4.0 + (i / 8)}});
  run.runTicks(10);
  for (int i = 0; i < 40; ++i) run.order("a" + std::to_string(i), Drive{{0.5, 0, 0.3}});
  run.runTicks(100);
  EXPECT_EQ(run.world.snapshot()->avatars.size(), 40u);
  EXPECT_LT(makeCheckpoint(run.world).size(), 40u * 4096);
}

TEST(Checkpoint, BytesThatWereChangedOrCutOffAreRefused) {
  const auto scene = makeLivelyRoom();
  const World world = makeLivelyWorld();
  const auto bytes = makeCheckpoint(world);
  ASSERT_GT(world.data().dynamicBodies.physicsWorld.pairs.size(), 20u);
  Random random(3);
  for (int i = 0; i < 3000; ++i) {
    auto spoilt = bytes;
    spoilt[i < 64 ? static_cast<std::size_t>(i) : random.drawBelow(bytes.size())] ^=
        static_cast<std::uint8_t>(1 + random.drawBelow(255));
    ASSERT_THROW(restoreWorld(scene, spoilt), CheckpointError);
  }
  for (int i = 0; i < 200; ++i) {
    const std::span cut(bytes.data(),
                        i < 64 ? static_cast<std::size_t>(i) : random.drawBelow(bytes.size()));
    ASSERT_THROW(restoreWorld(scene, cut), CheckpointError) << cut.size();
  }
  auto longer = bytes;
  longer.push_back(0);
  EXPECT_THROW(restoreWorld(scene, longer), CheckpointError);
}

/// The checksum is recomputed, so that only the validation of the content can refuse forged bytes.
TEST(Checkpoint, BytesThatWereForgedMakeAWorldThatTicksOrNone) {
  const auto scene = makeLivelyRoom();
  const auto bytes = makeCheckpoint(makeLivelyWorld());
  Random random(5);
  int refused = 0, ticked = 0;
  for (int i = 0; i < 150; ++i) {
    auto forged = bytes;
    const std::size_t at = 32 + random.drawBelow(bytes.size() - 40);
    forged[at] = static_cast<std::uint8_t>(random.drawBelow(256));
    recomputeChecksum(forged);
    try {
      World world = restoreWorld(scene, forged);
      for (int t = 0; t < 3; ++t) tickWorld(world);
      ++ticked;
    } catch (const CheckpointError&) {
      ++refused;
    } catch (const std::invalid_argument&) {
      ++refused;  // a coordinate that the narrow phase cannot take
    }
  }
  EXPECT_GT(refused, 5);
  EXPECT_GT(ticked, 30);
}

/// The reason why a checkpoint is refused; "" if it is accepted.
std::string findRefusal(const std::shared_ptr<const Scene>& scene,
                        const std::vector<std::uint8_t>& from) {
  try {
    restoreWorld(scene, from);
  } catch (const CheckpointError& error) {
    return error.what();
  }
  return "";
}

TEST(Checkpoint, UnsortedEntriesAreRefused) {
  const auto scene = makeLivelyRoom();
  World contacts = makeLivelyWorld();
  ASSERT_GT(contacts.data().bodyContacts.size(), 2u);
  EXPECT_EQ(findRefusal(scene, makeCheckpoint(contacts)), "");
  std::swap(contacts.data().bodyContacts[0], contacts.data().bodyContacts[1]);
  EXPECT_NE(findRefusal(scene, makeCheckpoint(contacts)).find("do not ascend"), std::string::npos);
  World avatars = makeLivelyWorld();
  ASSERT_GT(avatars.data().avatars.size(), 1u);
  std::swap(avatars.data().avatars[0], avatars.data().avatars[1]);
  EXPECT_NE(findRefusal(scene, makeCheckpoint(avatars)).find("names of avatars do not ascend"),
            std::string::npos);
  World solids = makeLivelyWorld();
  DynamicBodies& stage = solids.data().dynamicBodies;
  const auto entity = [&](std::size_t i) {
    return stage.entities[stage.physicsBodyOf[stage.bodyIndices[i]]];
  };
  std::swap(stage.physicsBodyByPart.at({entity(0), 0}), stage.physicsBodyByPart.at({entity(1), 0}));
  EXPECT_NE(findRefusal(scene, makeCheckpoint(solids)).find("the first physics bodies"),
            std::string::npos);
}

/// A change of a lively world to one with an index or an id out of range.
struct Forgery {
  const char* name;
  std::function<void(WorldData&)> forge;
  const char* reason;
};

TEST(Checkpoint, IndicesOutOfRangeAreRefused) {
  const auto addPhysicsBody = [](DynamicBodies& stage) -> std::uint32_t {
    stage.physicsWorld.bodies.push_back(stage.physicsWorld.bodies.front());
    return static_cast<std::uint32_t>(stage.physicsWorld.bodies.size() - 1);
  };
  const std::vector<Forgery> forgeries{
      {"physics body",
       [&](WorldData& world) {
         // One more body, so that the forged index can be written.
         auto& stage = world.dynamicBodies;
         std::prev(stage.physicsBodyByPart.end())->second = addPhysicsBody(stage);
       },
       "two physics bodies share an index"},
      {"free slot",
       [](WorldData& world) {
         auto& stage = world.dynamicBodies;
         stage.freeSlots.push_back(static_cast<std::uint32_t>(stage.physicsWorld.bodies.size()) +
                                   1);
       },
       "two physics bodies share an index"},
      {"pair",
       [](WorldData& world) {
         auto& [bodies, pairs] = world.dynamicBodies.physicsWorld;
         pairs.back().key.b = static_cast<std::uint32_t>(bodies.size());
       },
       "a pair has an unknown physics body"},
      {"contact of a body",
       [](WorldData& world) { world.bodyContacts.back().first.first = world.firstAvatarId(); },
       "a body touches an unknown entity"},
  };
  const auto scene = makeLivelyRoom();
  for (const Forgery& forgery : forgeries) {
    World world = makeLivelyWorld();
    forgery.forge(world.data());
    const std::string reason = findRefusal(scene, makeCheckpoint(world));
    EXPECT_NE(reason.find(forgery.reason), std::string::npos) << forgery.name << ": " << reason;
  }
}

TEST(Checkpoint, OfAnotherSceneOrVersionIsRefusedWithBothNamed) {
  const auto bytes = makeCheckpoint(makeLivelyWorld(10));
  EXPECT_NE(findRefusal(makeBoxScene({makeFloorBox()}), bytes).find("another scene"),
            std::string::npos);
  auto later = bytes;
  ++later[8];
  EXPECT_NE(
      findRefusal(makeLivelyRoom(), later).find("version " + std::to_string(kCheckpointVersion)),
      std::string::npos);
}

}  // namespace
}  // namespace enfilade::scene
