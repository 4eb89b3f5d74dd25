#include "scene/world/world.hpp"

#include "scene/model/hasher.hpp"
#include "scene/world/avatars/order_execution.hpp"
#include "scene/world/bodies/body_state.hpp"
#include "scene/world/bodies/kinematic_drive.hpp"
#include "scene/world/bodies/step_dynamic_bodies.hpp"
#include "scene/world/contacts/avatar_contacts.hpp"
#include "scene/world/contacts/body_contacts.hpp"
#include "scene/world/contacts/triggers.hpp"
#include "scene/world/data/validation.hpp"
#include "scene/world/data/world_data.hpp"
#include "scene/world/tick.hpp"

namespace enfilade::scene {
namespace {

std::uint64_t computeSeedHash(const Scene& scene, const WorldSettings& settings) {
  Hasher hash(scene.hash());
  for (const double value : {settings.contactOffset, settings.stepHeight, settings.nearMissDistance,
                             settings.walkableNormalY, settings.gravity, settings.maxSpeed,
                             settings.tickDuration, settings.stuckTimeout, settings.maxJumpHeight,
                             settings.maxJointSpeed, settings.maxPushForce})
    hash.add(value);
  hash.add(static_cast<std::uint64_t>(settings.sliding));
  return hash.value();
}

void makeBodies(WorldData& world) {
  const std::vector<BodySpec>& specs = world.scene->model().bodies;
  world.bodies.resize(specs.size());
  for (std::uint32_t i = 0; i < specs.size(); ++i) {
    Body& body = world.bodies[i];
    body.spec = &specs[i];
    body.id = specs[i].objects[0] + 1;
    body.shape = world.scene->bodyShape(i);
    if (isKinematic(body.spec->kind)) {
      body.asleep = false;
      initKinematicDrive(body);
      world.kinematicBodies.push_back(i);
    } else {
      if (isTrigger(body.spec->kind)) world.triggers.push_back(i);
      setBodyPose(body, body.shape->origin, collision::Quat::Identity());
    }
    body.motionBounds = body.boxes.whole;
    body.proxy = world.broadPhase.insert(body.motionBounds);
    if (body.proxy >= world.bodyIndexByProxy.size())
      world.bodyIndexByProxy.resize(body.proxy + 1, kNoBody);
    world.bodyIndexByProxy[body.proxy] = i;
    world.bodyIndexById[body.id] = i;
    world.bodyIndexByName.emplace(body.spec->name, i);
  }
}

std::unique_ptr<WorldData> makeWorldData(std::shared_ptr<const Scene> scene,
                                         const WorldSettings& settings) {
  auto world = std::make_unique<WorldData>(std::move(scene), settings);
  world->hash = computeSeedHash(*world->scene, settings);
  makeBodies(*world);
  initDynamicBodies(*world);
  auto first = std::make_shared<Snapshot>();
  first->stateHash = world->hash;
  first->bodies = makeBodySnapshots(*world);
  world->snapshot = std::move(first);
  return world;
}

/// Replaces the name by the index.
std::optional<std::string> resolveBody(const WorldData& world, BodyHandle& body) {
  const auto found = world.bodyIndexByName.find(body.name);
  if (found == world.bodyIndexByName.end()) return "body: no body named '" + body.name + "'";
  body = BodyHandle(found->second);
  return std::nullopt;
}

/// The same for the doors and lifts of a walk. The error names the list.
std::optional<std::string> resolveWalkBodies(const WorldData& world, Walk& walk) {
  for (std::size_t i = 0; i < walk.opens.size(); ++i)
    if (auto error = resolveBody(world, walk.opens[i]))
      return "opens[" + std::to_string(i) + "]: " + *error;
  for (std::size_t i = 0; i < walk.rides.size(); ++i)
    if (auto error = resolveBody(world, walk.rides[i].lift))
      return "rides[" + std::to_string(i) + "]: " + *error;
  return std::nullopt;
}

}  // namespace

World::World(std::shared_ptr<const Scene> scene, const WorldSettings& settings)
    : data_(makeWorldData(std::move(scene), settings)) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const Scene& World::scene() const {
  return *data_->scene;
}
const WorldSettings& World::settings() const {
  return data_->settings;
}
std::shared_ptr<const Snapshot> World::snapshot() const {
  return data_->snapshot;
}

std::optional<std::string> submitAvatarCommand(World& world, Command command) {
  if (auto error = validateCommandFields(command, world.settings())) return error;
  WorldData& data = world.data();
  if (Walk* walk = std::get_if<Walk>(&command.order)) {
    if (auto error = resolveWalkBodies(data, *walk)) return error;
    if (auto error = validateWalkBodies(data, *walk)) return error;
  }
  if (data.queuedOrderCount + computeOrderCost(command.order) > kMaxQueuedOrders)
    return std::to_string(kMaxQueuedOrders) +
           " orders and waypoints are already queued; send more when some have ended";
  data.queuedOrderCount += computeOrderCost(command.order);
  data.pendingCommands.push_back(std::move(command));
  return std::nullopt;
}

std::optional<std::string> submitBodyCommand(World& world, BodyCommand command) {
  if (auto error = resolveBody(world.data(), command.body)) return error;
  if (auto error = validateBodyCommand(world.data(), command)) return error;
  world.data().pendingBodyCommands.push_back(std::move(command));
  return std::nullopt;
}

TickReport tickWorld(World& world) {
  return runTick(world.data());
}

void setThreadCount(World& world, int threads) {
  world.data().threads.maxThreads = threads;
}

void setAuditInterval(World& world, std::uint32_t everyTicks) {
  world.data().auditCursor = {everyTicks, 0};
}

std::vector<ContactEvent> endAllContacts(World& world, ContactEvent::Reason reason) {
  std::vector<ContactEvent> events;
  for (Avatar& avatar : world.data().avatars)
    endAvatarContacts(world.data(), avatar, reason, events);
  endBodyContacts(world.data(), reason, events);
  for (const Body& trigger : world.data().bodies) {
    const std::vector<EntityId> inside = trigger.occupants;  // copy: the loop removes from it
    for (const EntityId entity : inside) removeFromTriggers(world.data(), entity, reason, events);
  }
  return events;
}

std::string findEntityName(const World& world, EntityId id) {
  return world.data().findEntityName(id);
}

}  // namespace enfilade::scene
