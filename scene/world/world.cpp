#include "scene/world/world.hpp"

#include "scene/model/hasher.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

std::uint64_t seedHash(const Scene& scene, const Lengths& l) {
  Hasher hash(scene.hash());
  for (const double length :
       {l.epsilon, l.stepHeight, l.nearMiss, l.walkableNormalY, l.gravity, l.speedLimit, l.tick,
        l.patience, l.jumpLimit, l.jointSpeedLimit, l.pushForce})
    hash.add(length);
  hash.add(static_cast<std::uint64_t>(l.sliding));
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
  return refusalOf(command, world.lengths());
}

std::optional<std::string> submit(World& world, Command command) {
  if (auto why = refusal(world, command)) return why;
  WorldState& state = world.state();
  if (state.waiting + sizeOf(command.order) > kMostWaiting)
    return std::to_string(kMostWaiting) +
           " orders and way points wait already; send more when some have ended";
  state.waiting += sizeOf(command.order);
  state.incoming.push_back(std::move(command));
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
  endBodyContacts(world.state(), reason, events);
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
