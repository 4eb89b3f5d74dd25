#include "scene/world.hpp"

#include <charconv>
#include <cmath>

#include "scene/hasher.hpp"
#include "scene/world_state.hpp"

namespace enfilade::scene {
namespace {

constexpr double kFarthest = 1e7;       // metres: doubles still resolve a nanometre there
constexpr double kLongestWait = 86400;  // seconds
constexpr std::size_t kLongestName = 64;
constexpr std::size_t kMostWayPoints = 100000;

std::string number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "infinity" : "-infinity";
  std::array<char, 32> text{};  // the shortest form that reads back as the value: 1e+300
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

using Refusal = std::optional<std::string>;

Refusal outside(const std::string& field, double value, double least, double most) {
  if (value >= least && value <= most) return std::nullopt;
  return field + " is " + number(value) + "; it must lie in " + number(least) + ".." + number(most);
}

Refusal badPoint(const std::string& field, const Vec3& point) {
  constexpr std::array<const char*, 3> kAxes{".x", ".y", ".z"};
  for (int i = 0; i < 3; ++i)
    if (auto why = outside(field + kAxes[i], point[i], -kFarthest, kFarthest)) return why;
  return std::nullopt;
}

Refusal badName(const std::string& field, const std::string& name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  bool good = !name.empty() && name.size() <= kLongestName && name[0] != '.';
  for (const char c : name) good = good && allowed(c);
  if (good) return std::nullopt;
  return field + " must be 1 to 64 letters, digits, '.', '_' or '-', and not begin with '.'";
}

Refusal refusalOf(const Spawn& spawn, const Lengths&) {
  if (auto why = badPoint("at", spawn.at)) return why;
  if (auto why = outside("facing", spawn.facing, -1e6, 1e6)) return why;
  if (auto why = outside("radius", spawn.radius, 0.05, 5)) return why;
  return outside("height", spawn.height, 0.2, 10);
}

Refusal refusalOf(const Walk& walk, const Lengths& lengths) {
  if (walk.along.empty()) return "along has no way point; give at least one";
  if (walk.along.size() > kMostWayPoints)
    return "along has more than " + std::to_string(kMostWayPoints) + " way points";
  for (std::size_t i = 0; i < walk.along.size(); ++i)
    if (auto why = badPoint("along[" + std::to_string(i) + "]", walk.along[i])) return why;
  if (!(walk.speed > 0)) return "speed is " + number(walk.speed) + "; it must be above 0";
  return outside("speed", walk.speed, 0, lengths.speedLimit);
}

Refusal refusalOf(const Look& look, const Lengths&) {
  return badPoint("at", look.at);
}
Refusal refusalOf(const Wait& wait, const Lengths&) {
  return outside("seconds", wait.seconds, 0, kLongestWait);
}
Refusal refusalOf(const Capture& capture, const Lengths&) {
  return badName("as", capture.as);
}
Refusal refusalOf(const Leave&, const Lengths&) {
  return std::nullopt;
}
Refusal refusalOf(const Drive& drive, const Lengths& lengths) {
  if (auto why = badPoint("velocity", drive.velocity)) return why;
  return outside("velocity's length", drive.velocity.norm(), 0, lengths.speedLimit);
}

std::uint64_t seedHash(const Scene& scene, const Lengths& l) {
  Hasher hash(scene.hash());
  for (const double length : {l.epsilon, l.stepHeight, l.nearMiss, l.walkableNormalY, l.gravity,
                              l.speedLimit, l.tick, l.patience, l.pushForce})
    hash.add(length);
  return hash.value();
}

void makeBodies(WorldState& world) {
  const std::vector<BodySpec>& specs = world.scene->model().bodies;
  world.bodies.resize(specs.size());
  for (std::uint32_t i = 0; i < specs.size(); ++i) {
    Body& body = world.bodies[i];
    body.spec = &specs[i];
    body.id = specs[i].objects[0] + 1;
    body.shape = world.scene->shapeOfBody(i);
    if (isKinematic(body.spec->kind)) {
      body.asleep = false;
      startDrive(body);
      world.kinematics.push_back(i);
    } else {
      if (body.spec->kind == BodyKind::trigger) world.triggers.push_back(i);
      placeBody(body, body.shape->origin, collision::Quat::Identity());
    }
    body.reach = boxOf(body);
    body.mover = world.broadPhase.insert(body.reach);
    world.bodyOfMover[body.mover] = i;
    world.bodyOfId[body.id] = i;
  }
}

}  // namespace

WorldState::WorldState(std::shared_ptr<const Scene> still, const Lengths& l)
    : scene(std::move(still)),
      lengths(l),
      hash(seedHash(*scene, l)),
      broadPhase(scene->stillBoxes()) {
  makeBodies(*this);
  startRigids(*this);
  auto first = std::make_shared<Snapshot>();
  first->stateHash = hash;
  first->bodies = viewsOfBodies(*this);
  snapshot = std::move(first);
}

World::World(std::shared_ptr<const Scene> scene, const Lengths& lengths)
    : state_(std::make_unique<WorldState>(std::move(scene), lengths)) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const Scene& World::scene() const {
  return *state_->scene;
}
const Lengths& World::lengths() const {
  return state_->lengths;
}
std::shared_ptr<const Snapshot> World::snapshot() const {
  return state_->snapshot;
}

std::optional<std::string> refusal(const World& world, const Command& command) {
  if (auto why = badName("avatar", command.avatar)) return why;
  return std::visit([&](const auto& order) { return refusalOf(order, world.lengths()); },
                    command.order);
}

std::optional<std::string> submit(World& world, Command command) {
  if (auto why = refusal(world, command)) return why;
  world.state().incoming.push_back(std::move(command));
  return std::nullopt;
}

std::optional<std::string> refusal(const World& world, const BodyCommand& command) {
  for (const Body& body : world.state().bodies)
    if (body.spec->name == command.body) return refusalOf(body, command, world.lengths());
  return "body: there is none of the name '" + command.body + "'";
}

std::optional<std::string> submit(World& world, BodyCommand command) {
  if (auto why = refusal(world, command)) return why;
  world.state().incomingForBodies.push_back(std::move(command));
  return std::nullopt;
}

std::vector<ContactEvent> endContacts(World& world, ContactEvent::Reason reason) {
  std::vector<ContactEvent> events;
  for (auto& [name, avatar] : world.state().avatars)
    endContactsOf(world.state(), avatar, reason, events);
  for (const Body& trigger : world.state().bodies) {
    const std::vector<EntityId> inside = trigger.inside;  // grows shorter on the way
    for (const EntityId who : inside) leaveTriggers(world.state(), who, reason, events);
  }
  return events;
}

std::string nameOf(const World& world, EntityId id) {
  const WorldState& state = world.state();
  const EntityId first = state.firstAvatarId();
  if (id == 0) return "";
  if (const auto body = state.bodyOfId.find(id); body != state.bodyOfId.end())
    return state.bodies[body->second].spec->name;
  if (id < first) return state.scene->model().objects[id - 1].path;
  return id - first < state.avatarNames.size() ? state.avatarNames[id - first] : "";
}

}  // namespace enfilade::scene
