// What driven bodies touch and pass closely: still objects, and one another. Only those that moved
// in this tick are looked at, and of what is near them only what the broad phase told; what they
// are mounted on is left out (mounting.hpp). Their nearest parts decide, found without a memory of
// the last tick, so that nothing but where they stand shows in the numbers.
//
// Two that are clear of one another before and after the tick may have met in it. Between the ticks
// both go and turn evenly, and no point of either farther than it is told here; so from where they
// are d apart they stay clear for as much of the way as brings them d nearer (conservative
// advancement, from the end back to the beginning). A step is worth half a contact's distance at
// least: who came nearer than 3/4 of it is not missed, unless kMostLooks end the search, which is
// counted. Of a path that turns back within the tick only the ends are known here.
#include <limits>
#include <set>

#include "collision/refine.hpp"
#include "scene/bodies/mounting.hpp"
#include "scene/rotation.hpp"
#include "scene/world_state.hpp"

namespace enfilade::scene {
namespace {

using Key = std::pair<EntityId, EntityId>;

constexpr double kAnyDistance = std::numeric_limits<double>::infinity();
constexpr int kMostLooks = 256;  // back on the way of one pair in one tick; usual are none or few
constexpr double kRounding = 1e-9;  // relative, of a way: more than turning and summing may err

const Body* drivenBody(const WorldState& world, EntityId id) {
  const auto found = world.bodyOfId.find(id);
  if (found == world.bodyOfId.end()) return nullptr;
  const Body& body = world.bodies[found->second];
  return isKinematic(body.spec->kind) ? &body : nullptr;
}

/// About the body's axis, in this tick.
double turnOf(const WorldState& world, const Body& body) {
  return body.spin.dot(body.spec->axis) * world.lengths.tick;
}

/// Metres: no point of the entity goes farther in this tick.
double wayOf(const WorldState& world, EntityId entity) {
  const Body* body = drivenBody(world, entity);
  if (!body || !body->moved) return 0;
  const double turn = std::abs(turnOf(world, *body)) * body->shape->radius;
  return ((body->position - body->positionBefore).norm() + turn) * (1 + kRounding);
}

/// All that it went through in this tick.
Box wayBoxOf(const WorldState& world, const Body& body) {
  Box box = boxOf(body);
  if (!body.moved) return box;
  const double turn = std::abs(turnOf(world, body)) * body.shape->radius;
  for (int axis = 0; axis < 3; ++axis) {  // a point turns across the axis alone
    const double along = body.spec->axis[axis];
    const double across = std::sqrt(std::max(0.0, 1 - along * along)) + kRounding;
    const double moved = std::abs(body.position[axis] - body.positionBefore[axis]);
    const double way = (moved + across * turn) * (1 + kRounding);
    box.min[axis] -= way, box.max[axis] += way;
  }
  return box;
}

/// Whether they may have been nearer than `within` in this tick, by boxes.
bool mayMeet(const WorldState& world, const Key& key, double within) {
  const Box way = grown(wayBoxOf(world, *drivenBody(world, key.first)), within);
  if (const Body* other = drivenBody(world, key.second))
    return overlaps(way, wayBoxOf(world, *other));
  std::vector<std::uint32_t> parts;
  world.scene->parts(key.second - 1).query(way, parts);
  return !parts.empty();
}

/// Where it is at `part` of the tick; 1: now.
collision::Pose poseAt(const WorldState& world, const Body& body, double part) {
  if (!body.moved || part == 1) return {body.orientation, body.position};
  const Vec3 way = body.position - body.positionBefore;
  const collision::Quat turned = rotationAbout(body.spec->axis, part * turnOf(world, body));
  return {(turned * body.orientationBefore).normalized(), body.positionBefore + part * way};
}

std::vector<collision::TreeOfParts> treesAt(const WorldState& world, EntityId entity, double part) {
  if (const Body* body = drivenBody(world, entity))
    return {treeAt(*body->shape, poseAt(world, *body, part))};
  return treesOf(world.scene->parts(entity - 1));
}

bool isMounted(WorldState& world, const Key& key, double contact) {
  const auto [at, isNew] = world.mounted.try_emplace(key, false);
  if (isNew)
    at->second = isMountedOn(*world.scene, world.bodyOfId.at(key.first), key.second, contact);
  return at->second;
}

/// Those that moved with what they may be near to, or were: their reach began where they were.
std::set<Key> pairsOfMoved(const WorldState& world) {
  std::set<Key> pairs;
  for (const std::uint32_t i : world.goingBodies) {
    const Body& body = world.bodies[i];
    if (!body.moved) continue;
    for (const auto& partner : world.broadPhase.partners(body.mover)) {
      if (!partner.moves) {
        pairs.insert({body.id, world.scene->solidObjects()[partner.id] + 1});
      } else if (const auto met = world.bodyOfMover.find(partner.id);
                 met != world.bodyOfMover.end() &&
                 isKinematic(world.bodies[met->second].spec->kind)) {
        pairs.insert(std::minmax(body.id, world.bodies[met->second].id));
      }
    }
  }
  return pairs;
}

/// How they stand to one another at `part` of the tick; nullopt if they are farther apart than
/// `within`.
std::optional<Contact> look(const WorldState& world, const Key& key, double part, double within,
                            QueryCount& count) {
  std::size_t work = std::numeric_limits<std::size_t>::max();
  const auto first = treesAt(world, key.first, part), second = treesAt(world, key.second, part);
  const collision::NearestParts nearest = collision::nearestParts(first, second, within, work);
  ++count.narrow;
  if (nearest.found != collision::NearestParts::Found::nearest) return std::nullopt;
  if (nearest.decision.decidedBy == collision::DecidedBy::rational) ++count.rational;
  Contact found;
  found.other = key.second;
  found.decision = nearest.decision;
  collision::FeatureCache cache;
  found.touching = collision::isNearerThan(nearest.decision, nearest.a, nearest.b,
                                           contactLimit(world.lengths), cache);
  return found;
}

/// How they touched on their ways in this tick, after which they are `apart` metres apart.
std::optional<Contact> touchOnTheWay(const WorldState& world, const Key& key, double apart,
                                     QueryCount& count) {
  const double contact = contactLimit(world.lengths);
  const double way = wayOf(world, key.first) + wayOf(world, key.second);
  double part = 1;
  for (int i = 0; i < kMostLooks; ++i) {
    part -= std::max(apart - contact, contact / 2) / way;
    if (part <= 0) return std::nullopt;
    const auto found = look(world, key, part, contact + part * way, count);
    if (!found) return std::nullopt;
    if (found->touching) return found;
    apart = found->decision.distance * (1 - kRounding);
  }
  ++count.bounded;
  return std::nullopt;
}

}  // namespace

DrivenContacts drivenContacts(WorldState& world, const Nearness& nearness, QueryCount& count) {
  DrivenContacts driven;
  for (const Key& key : pairsOfMoved(world)) {
    const auto before = world.bodyContacts.find(key);
    const bool lasted = before != world.bodyContacts.end();
    if (!lasted && !mayMeet(world, key, nearness.limit)) continue;
    if (isMounted(world, key, nearness.contact)) continue;
    const double way = wayOf(world, key.first) + wayOf(world, key.second);
    const double within = std::max(nearness.limit, nearness.contact + way);
    const auto found = look(world, key, 1, lasted ? kAnyDistance : within, count);
    if (!found) continue;
    const double apart = found->decision.distance;
    std::optional<Contact> met;
    if (!found->touching && !(lasted && before->second.touching) && apart < nearness.contact + way)
      met = touchOnTheWay(world, key, apart, count);
    if (met) driven.onTheWay[key] = *met;
    if (lasted || met || found->touching || apart < nearness.limit) driven.now[key] = *found;
  }
  return driven;
}

}  // namespace enfilade::scene
