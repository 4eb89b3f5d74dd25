#include "scene/world/checkpoint/checkpoint_validation.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "scene/world/avatars/spawn.hpp"
#include "scene/world/bodies/kinematic_drive.hpp"
#include "scene/world/checkpoint/checkpoint_error.hpp"
#include "scene/world/checkpoint/layouts.hpp"
#include "scene/world/data/validation.hpp"

namespace enfilade::scene {
namespace {

void require(bool condition, const std::string& message) {
  if (!condition) throw CheckpointError("the checkpoint describes an impossible world: " + message);
}

void requireValid(const std::optional<std::string>& error, const std::string& subject) {
  require(!error, subject + ": " + error.value_or(""));
}

template <class Named>
bool doNamesAscend(const std::vector<Named>& list) {
  return std::ranges::adjacent_find(list, std::ranges::greater_equal(), &Named::name) == list.end();
}

struct CheckpointChecker {
  const WorldData& world;

  const WorldSettings& settings() const { return world.settings; }
  bool isAvatar(EntityId id) const { return id >= world.firstAvatarId(); }
  bool isKnown(EntityId id) const {
    return id < world.firstAvatarId() + world.avatarNames.size();  // 0: none
  }
  const Body* findBody(EntityId id) const {
    const auto at = world.bodyIndexById.find(id);
    return at == world.bodyIndexById.end() ? nullptr : &world.bodies[at->second];
  }

  void checkContacts(const Avatar& avatar, const std::string& name) const {
    for (std::size_t i = 0; i < avatar.contacts.size(); ++i) {
      const EntityId other = avatar.contacts[i].other;
      require(other != 0 && isKnown(other), name + " touches an unknown entity");
      require(i == 0 || avatar.contacts[i - 1].other < other, name + "'s contacts do not ascend");
    }
  }
  std::size_t countParts(const Obstacle& obstacle) const {
    if (const Body* body = findBody(obstacle.entity)) return getPartCount(*body);
    if (!isAvatar(obstacle.entity))
      return obstacle.entity == 0 ? 0 : world.scene->collisionGeometry(obstacle.entity - 1).size();
    if (const Avatar* avatar = world.findAvatar(obstacle.entity))
      return avatar->shape->parts.size();
    // An avatar that left after the broad phase ran: its parts are looked up again before use.
    return isKnown(obstacle.entity) ? ~std::size_t{0} : 0;
  }
  void checkObstacles(const Avatar& avatar, const std::string& name) const {
    const Obstacle* last = nullptr;
    for (const Obstacle& obstacle : avatar.obstacles.list) {
      require(obstacle.part < countParts(obstacle), name + " has an obstacle with an unknown part");
      require(
          avatar.pairsChanged || !isAvatar(obstacle.entity) || world.findAvatar(obstacle.entity),
          name + " has an obstacle that left, without a pending update");
      require(obstacle.moreCaches.size() < avatar.shape->parts.size(),
              name + " has obstacle caches of unknown parts");
      require(
          !last || std::pair(last->entity, last->part) < std::pair(obstacle.entity, obstacle.part),
          name + "'s obstacles do not ascend");
      last = &obstacle;
    }
  }
  void checkDenseObjects(const Avatar& avatar, const std::string& name) const {
    const auto& [list, dense, caches] = avatar.obstacles;
    for (std::size_t i = 0; i < dense.size(); ++i) {
      const EntityId id = dense[i].entity;
      require(id != 0 && !isAvatar(id) && !findBody(id) &&
                  world.scene->collisionGeometry(id - 1).size() > kMaxListedParts,
              name + " has a dense obstacle of few parts");
      require(i == 0 || dense[i - 1].entity < id, name + "'s dense obstacles do not ascend");
    }
    for (const auto& [pair, cache] : caches) {
      require(avatar.obstacles.findDense(pair.entity) &&
                  pair.part < world.scene->collisionGeometry(pair.entity - 1).size() &&
                  pair.avatarPart < avatar.shape->parts.size(),
              name + " has a cache of an unknown part");
    }
  }
  void checkQueue(const Avatar& avatar) const {
    const auto queue = std::ranges::lower_bound(world.queues, avatar.name, {}, &OrderQueue::name);
    require(queue != world.queues.end() && queue->avatar == avatar.id,
            avatar.name + " has no queue");
    const Order* order = queue->orders.empty() ? nullptr : &queue->orders.front().order;
    const Walk* walk = order ? std::get_if<Walk>(order) : nullptr;
    require(avatar.walk.waypointIndex < (walk ? walk->waypoints.size() : 1),
            avatar.name + " has an unknown waypoint");
    require(avatar.walk.waitsFor == 0 || (walk && findBody(avatar.walk.waitsFor)),
            avatar.name + " waits for an unknown body");
    const TurnProgress& turn = avatar.turn;
    require((turn.rate == 0 && turn.left == 0) || (order && std::holds_alternative<Turn>(*order)),
            avatar.name + " turns without a command");
    if (avatar.chain.speed == 0) return;
    const auto* joints = order ? std::get_if<DriveJoints>(order) : nullptr;
    require(joints && joints->targets.size() <= avatar.chain.links.size(),
            avatar.name + " moves joints without a command");
  }
  void checkAvatars() const {
    std::set<collision::ProxyId> proxies;
    for (const Body& body : world.bodies) proxies.insert(body.proxy);
    for (const Avatar& a : world.avatars) {
      const std::string& name = a.name;
      require(
          world.findAvatar(a.id) == &a && world.avatarNames[a.id - world.firstAvatarId()] == name,
          name + " has the id of another avatar");
      require(proxies.insert(a.proxy).second, name + " has the proxy of another entity");
      require(isKnown(a.groundEntity) && isKnown(a.blockedBy),
              name + " refers to an unknown entity");
      require(a.chain.speed >= 0 && a.chain.speed <= settings().maxJointSpeed,
              name + "'s joints are too fast");
      require(a.turn.rate >= 0 &&
                  a.turn.rate <= settings().maxJointSpeed * 180 / std::numbers::pi &&
                  std::abs(a.turn.left) <= 1e6 && std::abs(a.turn.heading) <= 1e6 &&
                  isKnown(a.turn.blockedBy),
              name + " has an impossible turn");
      for (const ChainLink& link : a.chain.links)
        require(isKnown(link.blockedBy) && std::min(link.value, link.target) >= link.joint.low &&
                    std::max(link.value, link.target) <= link.joint.high,
                name + " has a joint outside its limits");
      checkContacts(a, name);
      checkObstacles(a, name);
      checkDenseObjects(a, name);
      checkQueue(a);
    }
  }
  void checkCommand(const Command& command) const {
    requireValid(validateCommandFields(command, settings()), command.avatar);
    if (const Walk* walk = std::get_if<Walk>(&command.order))
      requireValid(validateWalkBodies(world, *walk), command.avatar);
  }
  void checkOrders() const {
    require(doNamesAscend(world.queues), "names of queues do not ascend");
    for (const OrderQueue& queue : world.queues)
      for (const QueuedOrder& queued : queue.orders)
        checkCommand({queue.name, queued.order, queued.tag});
    for (const Command& command : world.pendingCommands) checkCommand(command);
    for (const BodyCommand& command : world.pendingBodyCommands)
      requireValid(validateBodyCommand(world, command), "a command");
    require(world.queuedOrderCount <= kMaxQueuedOrders, "too many orders are queued");
  }
  void checkBodies() const {
    for (const Body& b : world.bodies) {
      require(isKnown(b.blockedBy), b.spec->name + " is blocked by an unknown entity");
      require(!isKinematic(b.spec->kind) || b.drive.speed > 0, b.spec->name + " has no speed");
      require(b.kinematicTarget.maxDisplacement >= 0 && b.kinematicTarget.velocityDeviation >= 0,
              b.spec->name + " moves by less than 0");
      require(std::is_sorted(b.occupants.begin(), b.occupants.end()),
              b.spec->name + "'s occupant order");
      for (const EntityId occupant : b.occupants) {
        const Body* visitor = findBody(occupant);
        require(world.findAvatar(occupant) || (visitor && !isTrigger(visitor->spec->kind)),
                b.spec->name + " contains an unknown entity");
      }
    }
    const EntityPair* last = nullptr;
    for (const auto& [key, contact] : world.bodyContacts) {
      require(findBody(key.first) && key.second != 0 && isKnown(key.second) &&
                  contact.other == key.second,
              "a body touches an unknown entity");
      require(!last || *last < key, "contacts of bodies do not ascend");
      last = &key;
    }
  }
};

bool isRotation(const collision::Mat3& m) {
  constexpr double kRounding = 1e-6;  // far above the error of a body's rotation in a world
  return ((m * m.transpose() - collision::Mat3::Identity()).array().abs() <= kRounding).all();
}

std::size_t countConvexParts(const PhysicsBody& body) {
  return body.parts.size() + (body.mesh ? body.mesh->triangles().size() : 0);
}

}  // namespace

void restoreAvatarShape(const Reader& a, Avatar& avatar) {
  constexpr double kRounding = 1e-12;  // relative: a few roundings, far below any step of a crouch
  Spawn order;
  if (avatar.spawnOrder) {
    order = *avatar.spawnOrder;
    if (order.parts.empty() && order.links.empty()) a.refuse("a prism must not have a spawn order");
  } else {
    order.radius = avatar.radius;
    order.height = avatar.spawnHeight;
  }
  if (const auto error = validateCommandFields(Command{"avatar", order, 0}, {})) a.refuse(*error);
  const double spawnHeight = avatar.spawnHeight, height = avatar.height, radius = avatar.radius;
  const double facing = avatar.facing;
  if (!(std::abs(facing) <= (avatar.spawnOrder ? 1e6 : 0)))
    a.refuse("an avatar has an impossible facing");
  try {
    applySpawnShape(order, a.settings, avatar);
  } catch (const std::invalid_argument& error) {
    a.refuse(error.what());
  }
  const bool same = avatar.spawnHeight == spawnHeight && avatar.radius == radius;
  const bool isCrouching = !avatar.spawnOrder && height < spawnHeight;
  if (!same || (height != spawnHeight && !isCrouching) ||
      height < (kMinCrouchFraction - kRounding) * spawnHeight)
    a.refuse("an avatar has an impossible height");
  if (isCrouching) avatar.shape = makePrismShape(radius, height, spawnHeight, a.settings);
  avatar.height = height;
  if (facing != avatar.facing) setFacing(avatar, facing);
}

void validateAvatarOrder(const WorldData& world) {
  require(doNamesAscend(world.avatars), "names of avatars do not ascend");
}

void validateRestoredWorld(const WorldData& world) {
  const CheckpointChecker checker{world};
  checker.checkOrders();
  checker.checkBodies();
  checker.checkAvatars();
}

void validateDynamicBodies(const WorldData& world) {
  const DynamicBodies& dynamicBodies = world.dynamicBodies;
  const std::vector<PhysicsBody>& physicsBodies = dynamicBodies.physicsWorld.bodies;
  for (std::uint32_t i = 0; i < dynamicBodies.bodyIndices.size(); ++i)
    require(dynamicBodies.physicsBodyOf[dynamicBodies.bodyIndices[i]] == i,
            "dynamic bodies are not the first physics bodies");
  for (const PhysicsBody& body : physicsBodies)
    require((body.substepVelocities.empty() || body.substepVelocities.size() == kSolverSubsteps) &&
                !(body.maxStepDisplacement < 0) && isRotation(body.rotation),
            "a physics body has an impossible motion or pose");
  const std::set<std::uint32_t> freeSlots(dynamicBodies.freeSlots.begin(),
                                          dynamicBodies.freeSlots.end());
  const BodyPair* last = nullptr;
  for (const BodyPair& pair : dynamicBodies.physicsWorld.pairs) {
    const auto [a, b, partA, partB] = pair.key;
    require(a < b && b < physicsBodies.size() && !freeSlots.contains(a) && !freeSlots.contains(b),
            "a pair has an unknown physics body");
    // A physics body without parts belongs to an avatar that has another shape now: its pairs are
    // dropped before use.
    require(
        (countConvexParts(physicsBodies[a]) == 0 || partA < countConvexParts(physicsBodies[a])) &&
            (countConvexParts(physicsBodies[b]) == 0 || partB < countConvexParts(physicsBodies[b])),
        "a pair has an unknown part");
    require(!last || last->key < pair.key, "pairs of physics bodies do not ascend");
    last = &pair;
  }
}

}  // namespace enfilade::scene
