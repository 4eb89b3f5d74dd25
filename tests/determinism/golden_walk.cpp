// Prints the final state hashes of worlds with all kinds of motion. Avatars on stairs, a crowd,
// flyers among slivers, a driven arm, doors and a lift, leaves that hit one another. A heap of
// dynamic bodies, a vibrating tray (by one thread and by two: these two lines must agree). Scenes
// and commands are made without libm, so that every build on every processor has the same input and
// must print the same lines.
#include <cstdio>
#include <memory>

#include "scene/world/world.hpp"
#include "tests/scene/thin_geometry.hpp"

namespace {

using namespace enfilade::scene;
using namespace enfilade::scene::testing;

int refusedCommands = 0;

void order(World& world, const std::string& name, Order o) {
  if (submitAvatarCommand(world, {name, std::move(o), 0})) ++refusedCommands;
}

void runTicks(World& world, int count) {
  for (int i = 0; i < count; ++i) tickWorld(world);
}

void print(const char* name, const World& world) {
  std::printf("%-8s %016llx after %llu ticks, %zu avatars\n", name,
              static_cast<unsigned long long>(world.snapshot()->stateHash),
              static_cast<unsigned long long>(world.snapshot()->tick),
              world.snapshot()->avatars.size());
}

Vec3 drawVelocity(Seeded& random, double maxSpeed, bool flies) {
  const double x = random.drawUniform(-maxSpeed, maxSpeed),
               z = random.drawUniform(-maxSpeed, maxSpeed);
  return {x, flies ? random.drawUniform(-maxSpeed, maxSpeed) : 0, z};
}

void runStairs() {
  Builder b;
  b.addBox("floor", {-10, -0.2, -10}, {10, 0, 10});
  for (int i = 0; i < 10; ++i)
    b.addBox("step", {0.3 * i, -0.1, -2}, {0.3 * i + 0.3, 0.17 * i + 0.17, 2});
  World world(std::make_shared<const Scene>(b.model));
  for (int i = 0; i < 6; ++i) {
    const std::string name = "walker" + std::to_string(i);
    const double z = 0.65 * i - 1.6;
    order(world, name, Spawn{{-2, 0, z}, 33.0 * i});
    order(world, name, Walk{{{2.8, 1.7, 0.5 * z}}, 1.1 + 0.1 * i});
    order(world, name, Jump{0.3 + 0.05 * i, Vec3(-2, 0, 0.1 * i)});
    order(world, name, Crouch{0.9});
    order(world, name, Walk{{{-3, 0, z}}, 1.4});
    order(world, name, Crouch{});
  }
  runTicks(world, 700);
  print("stairs", world);
}

void runCrowd() {
  Builder b;
  addSheetCell(b, "hall", {-6, 0, -2}, {6, 3, 2}, true);
  World world(std::make_shared<const Scene>(b.model));
  Seeded random(11);
  for (int i = 0; i < 40; ++i)
    order(world, "w" + std::to_string(i), Spawn{{-4.9 + i / 4, 0, -1.4 + 0.9 * (i % 4)}});
  for (int k = 0; k < 8; ++k) {
    runTicks(world, 40);
    for (int i = 0; i < 40; ++i)
      order(world, "w" + std::to_string(i), Drive{drawVelocity(random, 3, false)});
  }
  print("crowd", world);
}

void runFlyers() {
  Builder b;
  Seeded random(12);
  addSheetCell(b, "hall", {-4, 0, -4}, {4, 6, 4}, true);
  for (int i = 0; i < 40; ++i) {
    const Vec3 at = drawVelocity(random, 3.5, true) + Vec3(0, 3.2, 0);
    b.addSheet("pane",
               {at, at + Vec3(0.3, 0.1, 0), at + Vec3(0.4, 0.8, 0.3), at + Vec3(0, 0.7, 0.2)});
  }
  World world(std::make_shared<const Scene>(b.model));
  for (int i = 0; i < 16; ++i) {
    Spawn spawn;
    spawn.position = {-3.2 + 2 * (i % 4), 0.3 + 0.9 * (i / 8), -3.2 + 2 * (i / 4)};
    spawn.height = 0.6;
    spawn.flying = true;
    order(world, "f" + std::to_string(i), spawn);
  }
  for (int k = 0; k < 10; ++k) {
    runTicks(world, 20);
    for (int i = 0; i < 16; ++i)
      order(world, "f" + std::to_string(i), Drive{drawVelocity(random, k + 1, true)});
  }
  print("flyers", world);
}

void arm() {
  Builder b;
  b.addBox("floor", {-5, -0.2, -5}, {5, 0, 5});
  b.addBox("table", {0.9, 0, -2}, {2.4, 0.6, 2});
  b.addSheet("pane", {{-5, 0, -1.2}, {5, 0, -1.2}, {5, 3, -1.2}, {-5, 3, -1.2}});
  World world(std::make_shared<const Scene>(b.model));
  Spawn spawn;
  spawn.facing = 7;
  Link upper, lower;
  upper.joint = {LinkJoint::Kind::revolute, {0, 1.2, 0}, {0, 1, 0.2}, -3, 3};
  upper.points = {{0.4, -0.05, -0.05}, {1.2, -0.05, 0}, {1.2, 0.05, 0.05}, {0.4, 0.1, 0}};
  lower.parent = 0;
  lower.joint = {LinkJoint::Kind::revolute, {1.25, 0, 0}, {0, 0, 1}, -2.5, 2.5};
  lower.points = {{0, -0.04, -0.04}, {0.7, 0, 0}, {0, 0.05, 0}, {0, 0, 0.05}};
  spawn.links = {upper, lower};
  order(world, "arm", spawn);
  order(world, "bob", Spawn{{-1.5, 0, 1}});
  runTicks(world, 2);
  Seeded random(13);
  for (int k = 0; k < 20; ++k) {
    const double turn = random.drawUniform(-3, 3);
    order(world, "arm", DriveJoints{{turn, random.drawUniform(-2.5, 2.5)}, 1.0 + k, true});
    if (k % 4 == 0) order(world, "bob", Drive{drawVelocity(random, 2, false)});
    runTicks(world, 20);
  }
  print("arm", world);
}

void runDoors() {
  Builder b;
  b.addBox("floor", {-5, -0.2, -5}, {5, 0, 5});
  b.addBox("door", {0, 0.01, 0}, {0.9, 2, 0.04});
  b.addBox("platform", {2, 0.01, -1}, {4, 0.1, 1});
  BodySpec door;
  door.name = "door";
  door.kind = BodyKind::hinged;
  door.objects = {1};
  door.axis = Vec3::UnitY();
  door.low = -1.5;
  door.high = 1.5;
  door.speed = 2;
  BodySpec lift = door;
  lift.name = "lift";
  lift.kind = BodyKind::lift;
  lift.objects = {2};
  lift.anchor = {3, 0, 0};
  lift.low = 0;
  lift.high = 3;
  lift.stops = {0, 3};
  lift.speed = 0.7;
  b.model.bodies = {door, lift};
  World world(std::make_shared<const Scene>(b.model));
  order(world, "ann", Spawn{{0.5, 0, -1}});
  order(world, "bob", Spawn{{3, 0.1, 0}});
  order(world, "ann", Walk{{{0.5, 0, 1}}, 1});
  runTicks(world, 30);
  for (int k = 0; k < 4; ++k) {
    BodyCommand swing, rise;
    swing.body = "door";
    swing.action = k % 2 ? BodyCommand::Action::close : BodyCommand::Action::open;
    rise.body = "lift";
    rise.action = BodyCommand::Action::moveTo;
    rise.target = k % 2 ? 0 : 3;
    if (submitBodyCommand(world, swing)) ++refusedCommands;
    if (submitBodyCommand(world, rise)) ++refusedCommands;
    runTicks(world, 150);
  }
  print("doors", world);
}

/// Leaves that turn into one another and a cart through a shelf, fast enough to pass between ticks.
void runClashes() {
  Builder b;
  b.addBox("floor", {-5, -0.2, -5}, {5, 0, 5});
  b.addBox("shelf", {1, 0, 1}, {1.05, 2, 3});
  Seeded random(31);
  for (std::uint32_t i = 0; i < 6; ++i) {
    const Vec3 at(0.7 * i - 2, 0.01, random.drawUniform(-0.4, 0.4));
    b.addBox("leaf", at, at + Vec3(random.drawUniform(0.8, 1.2), 2, 0.04));
    BodySpec leaf;
    leaf.name = "leaf" + std::to_string(i);
    leaf.kind = BodyKind::hinged;
    leaf.objects = {i + 2};
    leaf.anchor = at;
    leaf.axis = Vec3::UnitY();
    leaf.low = -3, leaf.high = 3;
    leaf.speed = random.drawUniform(1, 40);
    b.model.bodies.push_back(leaf);
  }
  b.addBox("cart", {-3, 0.1, 1.5}, {-2.9, 1, 2});
  BodySpec cart;
  cart.name = "cart";
  cart.kind = BodyKind::path;
  cart.objects = {8};
  cart.anchor = {-3, 0, 1.5};
  cart.axis = Vec3::UnitY();
  cart.keys = {{0, Vec3::Zero(), 0}, {0.2, {6, 0, 0}, 2}, {0.5, Vec3::Zero(), 0}};
  cart.loops = true;
  b.model.bodies.push_back(cart);
  WorldSettings settings;
  settings.nearMissDistance = 0.1;
  World world(std::make_shared<const Scene>(b.model), settings);
  for (int k = 0; k < 40; ++k) {
    BodyCommand swing;
    swing.body = "leaf" + std::to_string(k % 6);
    swing.action = BodyCommand::Action::moveTo;
    swing.target = random.drawUniform(-3, 3);
    if (submitBodyCommand(world, swing)) ++refusedCommands;
    runTicks(world, 6);
  }
  print("clashes", world);
}

/// Boxes, slabs and wedges thrown on a heap, with an avatar that walks into it.
void runHeap() {
  Builder b;
  b.addBox("floor", {-5, -0.2, -5}, {5, 0, 5});
  Seeded random(14);
  for (std::uint32_t i = 0; i < 24; ++i) {
    const Vec3 at(0.45 * (i % 3) - 0.45, 0.1 + 0.5 * (i / 6), 0.4 * (i % 2));
    const double wide = random.drawUniform(0.15, 0.35), high = random.drawUniform(0.1, 0.4);
    b.addBox("piece", at, at + Vec3(wide, high, random.drawUniform(0.15, 0.35)));
    BodySpec piece;
    piece.name = "piece" + std::to_string(i);
    piece.objects = {i + 1};
    piece.friction = random.drawUniform(0.1, 0.8);
    piece.restitution = random.drawUniform(0, 0.4);
    b.model.bodies.push_back(piece);
  }
  World world(std::make_shared<const Scene>(b.model));
  order(world, "ann", Spawn{{-2.5, 0, 0.2}});
  order(world, "ann", Walk{{{2.5, 0, 0.2}}, 1.2});
  runTicks(world, 300);
  print("heap", world);
}

/// Small boxes on a vibrating tray: enough of them for the solver to use several threads.
void runTray(int threads, const char* name) {
  Builder b;
  b.addBox("floor", {-5, -0.2, -5}, {5, 0, 5});
  b.addBox("plate", {-0.2, 0.5, -0.2}, {0.2, 0.52, 0.2});
  Seeded random(15);
  for (std::uint32_t i = 0; i < 120; ++i) {
    const Vec3 at(0.032 * (i % 5) - 0.08, 0.525 + 0.03 * (i / 25), 0.032 * (i / 5 % 5) - 0.08);
    const double wide = random.drawUniform(0.01, 0.03), high = random.drawUniform(0.01, 0.025);
    b.addBox("piece", at, at + Vec3(wide, high, random.drawUniform(0.01, 0.03)));
    BodySpec piece;
    piece.name = "piece" + std::to_string(i);
    piece.objects = {i + 2};
    b.model.bodies.push_back(piece);
  }
  BodySpec plate;
  plate.name = "plate";
  plate.kind = BodyKind::path;
  plate.objects = {1};
  plate.loops = true;
  for (int i = 0; i <= 8; ++i) {
    const double up = i < 4 ? i - 2 : 6 - i;  // a triangle wave
    plate.keys.push_back({i / 120.0, {0.2e-3 * up, 0.7e-3 * up, 0}, 0});
  }
  b.model.bodies.push_back(plate);
  World world(std::make_shared<const Scene>(b.model));
  setThreadCount(world, threads);
  runTicks(world, 90);
  print(name, world);
}

}  // namespace

int main() {
  runStairs();
  runCrowd();
  runFlyers();
  arm();
  runDoors();
  runClashes();
  runHeap();
  runTray(1, "tray/1");
  runTray(2, "tray/2");
  std::printf("refused  %d commands\n", refusedCommands);
}
