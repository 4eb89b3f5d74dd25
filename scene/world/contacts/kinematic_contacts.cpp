// What driven bodies touch and pass closely: still objects, and one another. Only those that moved
// in this tick are looked at, and of what is near them only what the broad phase told; what they
// are mounted on is left out (mounting.hpp). Their nearest parts decide, found without a memory of
// the last tick, so that nothing but where they stand shows in the numbers.
//
// Two that are clear of one another before and after the tick may have met in it. Where their ways
// are longer than the room between them, their parts are swept (body_sweep.hpp), stretch by
// stretch, as far as they do not come nearer than 3/4 of a contact's distance.
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "collision/narrow_phase/refine.hpp"
#include "scene/world/bodies/body_sweep.hpp"
#include "scene/world/contacts/excluded_pairs.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

using Key = EntityPair;

constexpr double kAnyDistance = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-9;  // relative, of a way: more than turning and summing may err

const Body* drivenBody(const WorldState& world, EntityId id) {
  const auto found = world.bodyOfId.find(id);
  if (found == world.bodyOfId.end()) return nullptr;
  const Body& body = world.bodies[found->second];
  return isKinematic(body.spec->kind) ? &body : nullptr;
}

/// Metres: no point of the entity went farther in this tick.
double wayOf(const WorldState& world, EntityId entity) {
  const Body* body = drivenBody(world, entity);
  if (!body || !body->moved) return 0;
  const BodyPlan& plan = body->plan;
  double way = 0;
  for (std::size_t i = 0; i < plan.stretches; ++i)
    way += farthestWay(*body->shape, plan.places[i], plan.places[i + 1]);
  return way * (1 + kRounding);
}

/// The box of what is there now, no farther than `radius` from the body's origin, widened to all
/// that it went through in this tick.
Box wayBoxOf(const Body& body, const Box& box, double radius) {
  if (!body.moved) return box;
  Vec3 stray = Vec3::Zero();
  const BodyPlace& now = body.drive.place;
  for (std::size_t i = 0; i < body.plan.stretches; ++i) {
    const BodyPlace& place = body.plan.places[i];
    const double turn = std::abs(place.turn - now.turn) * radius;
    for (int axis = 0; axis < 3; ++axis) {  // a point turns across the axis alone
      const double along = body.spec->axis[axis];
      const double across = std::sqrt(std::max(0.0, 1 - along * along)) + kRounding;
      const double moved = std::abs(place.offset[axis] - now.offset[axis]);
      stray[axis] = std::max(stray[axis], (moved + across * turn) * (1 + kRounding));
    }
  }
  return {box.min - stray, box.max + stray};
}

Box wayBoxOf(const Body& body) {
  return wayBoxOf(body, boxOf(body), body.shape->radius);
}

std::vector<Box> wayBoxesOfParts(const Body& body) {
  std::vector<Box> boxes;
  for (std::size_t i = 0; i < body.partBoxes.size(); ++i)
    boxes.push_back(wayBoxOf(body, body.partBoxes[i], body.shape->parts[i].radius));
  return boxes;
}

/// Whether they may have been nearer than `within` in this tick, by boxes.
bool mayMeet(const WorldState& world, const Key& key, double within) {
  const Box way = grown(wayBoxOf(*drivenBody(world, key.first)), within);
  if (const Body* other = drivenBody(world, key.second)) return overlaps(way, wayBoxOf(*other));
  std::vector<std::uint32_t> parts;
  world.scene->parts(key.second - 1).query(way, parts);
  return !parts.empty();
}

/// Parts of both that may have been nearer than `within` in this tick, by boxes.
using PartPairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
PartPairs partsThatMayMeet(const WorldState& world, const Key& key, double within) {
  const std::vector<Box> ways = wayBoxesOfParts(*drivenBody(world, key.first));
  const Body* other = drivenBody(world, key.second);
  const Box all = other ? wayBoxOf(*other) : Box{};
  const std::vector<Box> otherWays = other ? wayBoxesOfParts(*other) : std::vector<Box>{};
  PartPairs pairs;
  std::vector<std::uint32_t> met;
  for (std::uint32_t part = 0; part < ways.size(); ++part) {
    const Box way = grown(ways[part], within);
    met.clear();
    if (!other) {
      world.scene->parts(key.second - 1).query(way, met);
    } else if (overlaps(way, all)) {
      for (std::uint32_t i = 0; i < otherWays.size(); ++i)
        if (overlaps(way, otherWays[i])) met.push_back(i);
    }
    for (const std::uint32_t otherPart : met) pairs.emplace_back(part, otherPart);
  }
  return pairs;
}

std::vector<collision::TreeOfParts> treesNow(const WorldState& world, EntityId entity) {
  if (const Body* body = drivenBody(world, entity))
    return {treeAt(*body->shape, {body->orientation, body->position})};
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

/// How they stand to one another; nullopt if they are farther apart than `within`.
std::optional<Contact> look(const WorldState& world, const Key& key, double within,
                            QueryCount& count) {
  std::size_t work = std::numeric_limits<std::size_t>::max();
  const auto first = treesNow(world, key.first), second = treesNow(world, key.second);
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

/// The i-th of n equal parts of the body's tick: of its stretches, or of the one that it has.
BodyWay wayIn(const Body& body, std::size_t i, std::size_t n) {
  const auto place = [&](std::size_t at) {
    const BodyPlan& plan = body.plan;
    if (!body.moved) return body.drive.place;
    if (plan.stretches == n) return plan.places[at];
    return placeBetween(plan.places[0], plan.places[1],
                        static_cast<double>(at) / static_cast<double>(n));
  };
  const BodyPlace from = place(i), to = place(i + 1);
  const collision::Pose pose = poseAt(*body.spec, from);
  return {pose.rotation.toRotationMatrix(), pose.translation, to.offset - from.offset,
          body.spec->axis, to.turn - from.turn};
}

/// How they touched first on their ways in this tick.
std::optional<Contact> touchOnTheWay(const WorldState& world, const Key& key, QueryCount& count) {
  const double contact = contactLimit(world.lengths);
  const collision::StoppingBand band{0.75 * contact, (1 - kRounding) * contact};
  const Body& body = *drivenBody(world, key.first);
  const Body* other = drivenBody(world, key.second);
  const PartPairs pairs = partsThatMayMeet(world, key, contact);
  const std::size_t n = std::max(body.plan.stretches, other ? other->plan.stretches : 1);
  for (std::size_t i = 0; i < n; ++i) {
    const BodyWay way = wayIn(body, i, n);
    const BodyWay otherWay = other ? wayIn(*other, i, n) : BodyWay();
    BodySweep first;
    for (const auto& [a, b] : pairs) {
      const MovingPart part{body.shape->parts[a], way};
      const BodySweep sweep =
          other ? sweepTurning(part, MovingPart{other->shape->parts[b], otherWay}, band, count)
                : sweepTurning(part, world.scene->parts(key.second - 1).body(b), band, count);
      if (sweep.reached && sweep.fraction < first.fraction) first = sweep;
    }
    if (first.reached) {
      Contact touch;
      touch.other = key.second;
      touch.touching = true;
      touch.decision = first.atStop;
      return touch;
    }
  }
  return std::nullopt;
}

}  // namespace

DrivenContacts drivenContacts(WorldState& world, const Nearness& nearness, QueryCount& count) {
  DrivenContacts driven;
  for (const Key& key : pairsOfMoved(world)) {
    const Contact* before = contactOf(world, key);
    const bool lasted = before != nullptr;
    if (!lasted && !mayMeet(world, key, nearness.limit)) continue;
    if (isMounted(world, key, nearness.contact)) continue;
    const double way = wayOf(world, key.first) + wayOf(world, key.second);
    const double within = std::max(nearness.limit, nearness.contact + way);
    const auto found = look(world, key, lasted ? kAnyDistance : within, count);
    if (!found) continue;
    const double apart = found->decision.distance;
    std::optional<Contact> met;
    if (!found->touching && !(lasted && before->touching) && apart < nearness.contact + way)
      met = touchOnTheWay(world, key, count);
    if (met) driven.onTheWay.emplace_back(key, *met);
    if (lasted || met || found->touching || apart < nearness.limit)
      driven.now.emplace_back(key, *found);
  }
  return driven;
}

}  // namespace enfilade::scene
