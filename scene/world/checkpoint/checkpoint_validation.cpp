#include "scene/world/checkpoint/checkpoint_validation.hpp"

#include <algorithm>
#include <set>

#include "scene/world/checkpoint/layouts.hpp"

namespace enfilade::scene {
namespace {

void require(bool good, const std::string& what) {
  if (!good) throw CheckpointError("the checkpoint tells of no world that can be: " + what);
}

void requireNone(const std::optional<std::string>& refusal, const std::string& whose) {
  require(!refusal, whose + ": " + refusal.value_or(""));
}

struct Check {
  const WorldState& world;

  const Lengths& lengths() const { return world.lengths; }
  bool isAvatar(EntityId id) const { return id >= world.firstAvatarId(); }
  bool isKnown(EntityId id) const {
    return id < world.firstAvatarId() + world.avatarNames.size();  // 0: nobody
  }
  const Avatar* avatar(EntityId id) const {
    if (!isAvatar(id) || !isKnown(id)) return nullptr;
    const auto at = world.avatars.find(world.avatarNames[id - world.firstAvatarId()]);
    return at != world.avatars.end() && at->second.id == id ? &at->second : nullptr;
  }
  const Body* body(EntityId id) const {
    const auto at = world.bodyOfId.find(id);
    return at == world.bodyOfId.end() ? nullptr : &world.bodies[at->second];
  }

  void contacts(const Avatar& avatar, const std::string& name) const {
    for (std::size_t i = 0; i < avatar.contacts.size(); ++i) {
      const EntityId other = avatar.contacts[i].other;
      require(other != 0 && isKnown(other), name + " touches what is not there");
      require(i == 0 || avatar.contacts[i - 1].other < other, name + "'s contacts do not ascend");
    }
  }
  std::size_t partsOf(const Obstacle& obstacle) const {
    if (const Body* met = body(obstacle.entity)) return met->partBoxes.size();
    if (!isAvatar(obstacle.entity))
      return obstacle.entity == 0 ? 0 : world.scene->parts(obstacle.entity - 1).size();
    if (const Avatar* met = avatar(obstacle.entity)) return met->shape->parts.size();
    // One who left after the broad phase was asked: it is looked for anew before it is met.
    return isKnown(obstacle.entity) ? ~std::size_t{0} : 0;
  }
  void obstacles(const Avatar& avatar, const std::string& name) const {
    const Obstacle* last = nullptr;
    for (const Obstacle& obstacle : avatar.obstacles) {
      require(obstacle.part < partsOf(obstacle), name + " is near a part that is not there");
      require(avatar.pairsChanged || !isAvatar(obstacle.entity) || this->avatar(obstacle.entity),
              name + " is near somebody who left, and nobody will look");
      require(obstacle.moreCaches.size() < avatar.shape->parts.size(),
              name + " has fewer parts than are near something");
      require(
          !last || std::pair(last->entity, last->part) < std::pair(obstacle.entity, obstacle.part),
          name + "'s obstacles do not ascend");
      last = &obstacle;
    }
  }
  void queue(const std::string& name) const {
    const auto at = world.queues.find(name);
    const Avatar* avatar = world.avatars.contains(name) ? &world.avatars.at(name) : nullptr;
    if (!avatar) return;
    const bool waits = at != world.queues.end() && !at->second.empty();
    const Walk* walk = waits ? std::get_if<Walk>(&at->second.front().order) : nullptr;
    require(avatar->walk.leg < (walk ? walk->along.size() : 1), name + " walks to no way point");
    if (avatar->chain.speed == 0) return;
    const auto* joints = waits ? std::get_if<DriveJoints>(&at->second.front().order) : nullptr;
    require(joints && joints->to.size() <= avatar->chain.links.size(),
            name + " moves joints that nobody drives");
  }
  void avatars() const {
    std::set<collision::MoverId> movers;
    for (const Body& body : world.bodies) movers.insert(body.mover);
    for (const auto& [name, a] : world.avatars) {
      require(isAvatar(a.id) && avatar(a.id) == &a, name + " has the id of somebody else");
      require(movers.insert(a.mover).second, name + " has the box of somebody else");
      require(isKnown(a.standsOn) && isKnown(a.stoppedBy), name + " met what is not there");
      require(a.chain.speed >= 0 && a.chain.speed <= lengths().jointSpeedLimit,
              name + "'s joints are too fast");
      for (const ChainLink& link : a.chain.links)
        require(isKnown(link.stoppedBy) && std::min(link.value, link.target) >= link.joint.low &&
                    std::max(link.value, link.target) <= link.joint.high,
                name + " has a joint where it cannot be");
      contacts(a, name);
      obstacles(a, name);
      queue(name);
    }
  }
  void orders() const {
    for (const auto& [name, queue] : world.queues)
      for (const QueuedOrder& queued : queue)
        requireNone(refusalOf(Command{name, queued.order, queued.tag}, lengths()), name);
    for (const Command& command : world.incoming)
      requireNone(refusalOf(command, lengths()), command.avatar);
    for (const BodyCommand& command : world.incomingForBodies) {
      const auto at = std::find_if(world.bodies.begin(), world.bodies.end(), [&](const Body& body) {
        return body.spec->name == command.body;
      });
      require(at != world.bodies.end(), "there is no body '" + command.body + "'");
      requireNone(refusalOf(*at, command, lengths()), command.body);
    }
    require(world.waiting <= kMostWaiting, "too many orders wait");
  }
  void bodies() const {
    for (const Body& b : world.bodies) {
      require(isKnown(b.blockedBy), b.spec->name + " is blocked by nobody");
      require(!isKinematic(b.spec->kind) || b.drive.speed > 0, b.spec->name + " goes at no speed");
      require(b.plan.farthest >= 0 && b.plan.swing >= 0, b.spec->name + " goes less than nothing");
      require(std::is_sorted(b.inside.begin(), b.inside.end()), b.spec->name + "'s visitors");
      for (const EntityId who : b.inside) {
        const Body* visitor = body(who);
        require(avatar(who) || (visitor && visitor->spec->kind != BodyKind::trigger),
                b.spec->name + " is visited by nobody");
      }
    }
    const EntityPair* last = nullptr;
    for (const auto& [key, contact] : world.bodyContacts) {
      require(
          body(key.first) && key.second != 0 && isKnown(key.second) && contact.other == key.second,
          "a body touches what is not there");
      require(!last || *last < key, "contacts of bodies do not ascend");
      last = &key;
    }
  }
};

bool isRotation(const collision::Mat3& m) {
  constexpr double kRounding = 1e-6;
  return ((m * m.transpose() - collision::Mat3::Identity()).array().abs() <= kRounding).all();
}

std::size_t partsOf(const Solid& solid) {
  return solid.parts.size() + (solid.mesh ? solid.mesh->triangles().size() : 0);
}

}  // namespace

void shapeAsRead(const Reader& a, Avatar& avatar) {
  constexpr double kRounding = 1e-12;
  Spawn order;
  if (avatar.madeOf) {
    order = *avatar.madeOf;
    if (order.parts.empty() && order.links.empty()) a.refuse("a prism needs no order");
  } else {
    order.radius = avatar.radius;
    order.height = avatar.standing;
  }
  if (const auto why = refusalOf(Command{"avatar", order, 0}, {})) a.refuse(*why);
  const double standing = avatar.standing, height = avatar.height, radius = avatar.radius;
  try {
    shapeAvatar(order, a.lengths, avatar);
  } catch (const std::invalid_argument& why) {
    a.refuse(why.what());
  }
  const bool same = avatar.standing == standing && avatar.radius == radius;
  const bool crouches = !avatar.madeOf && height < standing;
  if (!same || (height != standing && !crouches) || height < (kLowestCrouch - kRounding) * standing)
    a.refuse("an avatar is as high as it cannot be");
  if (crouches) avatar.shape = prismShape(radius, height, standing, a.lengths);
  avatar.height = height;
}

void checkRead(const WorldState& world) {
  const Check check{world};
  check.orders();
  check.bodies();
  check.avatars();
}

void checkRigids(const WorldState& world) {
  const RigidStage& stage = world.rigids;
  const std::vector<Solid>& solids = stage.dynamics.solids;
  for (std::uint32_t i = 0; i < stage.bodies.size(); ++i)
    require(stage.solidOf[stage.bodies[i]] == i, "the free bodies are not the first solids");
  for (const Solid& solid : solids)
    require((solid.gaits.empty() || solid.gaits.size() == kSolverSubsteps) && !(solid.leash < 0) &&
                isRotation(solid.rotation),
            "a solid goes or stands as none can");
  const std::set<std::uint32_t> vacant(stage.vacant.begin(), stage.vacant.end());
  const NearPair* last = nullptr;
  for (const NearPair& pair : stage.dynamics.pairs) {
    const auto [a, b, partA, partB] = pair.key;
    require(a < b && b < solids.size() && !vacant.contains(a) && !vacant.contains(b),
            "two solids meet of which one is not there");
    // A solid without parts is of an avatar that has another shape now: its pairs are forgotten
    // before they are asked for.
    require((partsOf(solids[a]) == 0 || partA < partsOf(solids[a])) &&
                (partsOf(solids[b]) == 0 || partB < partsOf(solids[b])),
            "two solids meet by a part that is not there");
    require(!last || last->key < pair.key, "pairs of solids do not ascend");
    last = &pair;
  }
}

}  // namespace enfilade::scene
