// Contacts and near misses of kinematic bodies with static objects and with one another. Only
// bodies that moved in this tick are queried, and only against their broad-phase overlaps; excluded
// pairs (excluded_pairs.hpp) are skipped. The nearest parts are found without a warm start, so that
// the result depends on the current poses alone.
// Two bodies that are clear before and after the tick may have touched within it. If their motions
// are longer than their distance, their parts are cast (collision/motion/shape_cast.hpp) segment by
// segment; the cast keeps 3/4 of the contact distance.
#include "scene/world/contacts/kinematic_contacts.hpp"

#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "collision/compound/nearest_parts.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "scene/world/contacts/excluded_pairs.hpp"

namespace enfilade::scene {
namespace {

constexpr double kUnlimitedDistance = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-9;  // relative, of a motion: more than rotating and summing may err

const Body* findKinematicBody(const WorldData& world, EntityId id) {
  const auto found = world.bodyIndexById.find(id);
  if (found == world.bodyIndexById.end()) return nullptr;
  const Body& body = world.bodies[found->second];
  return isKinematic(body.spec->kind) ? &body : nullptr;
}

/// Upper bound of the displacement of any point of the entity in this tick, metres.
double computeMaxTravel(const WorldData& world, EntityId entity) {
  const Body* body = findKinematicBody(world, entity);
  if (!body || !body->moved) return 0;
  const KinematicTarget& target = body->kinematicTarget;
  double travel = 0;
  for (std::size_t i = 0; i < target.segments; ++i)
    travel += computeDisplacementBound(*body->shape, target.keyPoses[i], target.keyPoses[i + 1]);
  return travel * (1 + kRounding);
}

/// Extends an AABB at the current pose to the whole motion of this tick. `radius`: maximum distance
/// of its content from the body's origin.
Aabb computeSweptPartAabb(const Body& body, const Aabb& box, double radius) {
  if (!body.moved) return box;
  Vec3 extent = Vec3::Zero();
  const JointPose& now = body.drive.pose;
  for (std::size_t i = 0; i < body.kinematicTarget.segments; ++i) {
    const JointPose& jointPose = body.kinematicTarget.keyPoses[i];
    const double arcLength = std::abs(jointPose.angle - now.angle) * radius;
    for (int axis = 0; axis < 3; ++axis) {  // rotation moves a point only perpendicularly to the
                                            // axis
      const double axisComponent = body.spec->axis[axis];
      const double across = std::sqrt(std::max(0.0, 1 - axisComponent * axisComponent)) + kRounding;
      const double moved = std::abs(jointPose.offset[axis] - now.offset[axis]);
      extent[axis] = std::max(extent[axis], (moved + across * arcLength) * (1 + kRounding));
    }
  }
  return {box.min - extent, box.max + extent};
}

Aabb computeSweptAabb(const Body& body) {
  return computeSweptPartAabb(body, body.boxes.whole, body.shape->radius);
}

std::vector<Aabb> computeSweptPartAabbs(const Body& body) {
  std::vector<Aabb> boxes;
  for (std::uint32_t i = 0; i < getPartCount(body); ++i)
    boxes.push_back(computeSweptPartAabb(body, getPartBox(body, i), body.shape->parts[i].radius));
  return boxes;
}

/// True if the two may have been closer than `within` in this tick, by AABBs.
bool mayTouch(const WorldData& world, const EntityPair& key, double within) {
  const Aabb sweptBox = inflate(computeSweptAabb(*findKinematicBody(world, key.first)), within);
  if (const Body* other = findKinematicBody(world, key.second))
    return overlaps(sweptBox, computeSweptAabb(*other));
  std::vector<std::uint32_t> parts;
  world.scene->collisionGeometry(key.second - 1).query(sweptBox, parts);
  return !parts.empty();
}

/// Pairs of parts that may have been closer than `within` in this tick, by AABBs.
using PartPairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
PartPairs findPartPairsInRange(const WorldData& world, const EntityPair& key, double within) {
  const std::vector<Aabb> sweptBoxes = computeSweptPartAabbs(*findKinematicBody(world, key.first));
  const Body* other = findKinematicBody(world, key.second);
  const Aabb all = other ? computeSweptAabb(*other) : Aabb{};
  const std::vector<Aabb> otherSweptBoxes =
      other ? computeSweptPartAabbs(*other) : std::vector<Aabb>{};
  PartPairs pairs;
  std::vector<std::uint32_t> candidates;
  for (std::uint32_t part = 0; part < sweptBoxes.size(); ++part) {
    const Aabb sweptBox = inflate(sweptBoxes[part], within);
    candidates.clear();
    if (!other) {
      world.scene->collisionGeometry(key.second - 1).query(sweptBox, candidates);
    } else if (overlaps(sweptBox, all)) {
      for (std::uint32_t i = 0; i < otherSweptBoxes.size(); ++i)
        if (overlaps(sweptBox, otherSweptBoxes[i])) candidates.push_back(i);
    }
    for (const std::uint32_t otherPart : candidates) pairs.emplace_back(part, otherPart);
  }
  return pairs;
}

std::vector<collision::CompoundView> makeCompoundsNow(const WorldData& world, EntityId entity) {
  if (const Body* body = findKinematicBody(world, entity)) {
    collision::CompoundView view =
        makeCompoundView(*body->shape, {body->orientation, body->position});
    view.box = [body](std::uint32_t item) {
      return getPartBox(*body, body->shape->tree.order[item]);
    };
    return {std::move(view)};
  }
  return makeCompoundViews(world.scene->collisionGeometry(entity - 1));
}

bool isExcluded(WorldData& world, const EntityPair& key, double contact) {
  const auto [at, isNew] = world.excludedPairCache.try_emplace(key, false);
  if (isNew)
    at->second =
        isExcludedPair(*world.scene, world.bodyIndexById.at(key.first), key.second, contact);
  return at->second;
}

/// Pairs of a moved body and an entity that is or was close: its motion bounds include the start.
std::set<EntityPair> collectMovedPairs(const WorldData& world) {
  std::set<EntityPair> pairs;
  for (const std::uint32_t i : world.movingBodies) {
    const Body& body = world.bodies[i];
    if (!body.moved) continue;
    for (const auto& overlap : world.broadPhase.getOverlaps(body.proxy)) {
      if (!overlap.isDynamic) {
        pairs.insert({body.id, world.scene->solidObjects()[overlap.id] + 1});
      } else if (const std::uint32_t other = world.findBodyByProxy(overlap.id);
                 other != kNoBody && isKinematic(world.bodies[other].spec->kind)) {
        pairs.insert(std::minmax(body.id, world.bodies[other].id));
      }
    }
  }
  return pairs;
}

/// Makes the boxes of the parts of both, which computeContact() uses.
void makePartBoxes(WorldData& world, const EntityPair& key) {
  for (const EntityId id : {key.first, key.second})
    if (const auto found = world.bodyIndexById.find(id); found != world.bodyIndexById.end())
      makePartBoxes(world.bodies[found->second]);
}

/// Current separation; nullopt if they are farther apart than `within`.
std::optional<Contact> computeContact(const WorldData& world, const EntityPair& key, double within,
                                      QueryCount& count) {
  std::size_t budget = std::numeric_limits<std::size_t>::max();
  const auto first = makeCompoundsNow(world, key.first),
             second = makeCompoundsNow(world, key.second);
  const collision::NearestParts nearest =
      collision::findNearestParts(first, second, within, budget);
  ++count.narrow;
  if (nearest.outcome != collision::NearestParts::Outcome::nearest) return std::nullopt;
  if (nearest.separation.certificate == collision::Certificate::rational) ++count.rational;
  Contact found;
  found.other = key.second;
  found.separation = nearest.separation;
  collision::FeatureCache cache;
  found.touching = collision::isCloserThan(nearest.separation, nearest.a, nearest.b,
                                           computeContactThreshold(world.settings), cache);
  return found;
}

/// The i-th of n equal parts of the body's tick: its own segments, or equal parts of its one
/// segment.
collision::ScrewMotion makeSegmentMotion(const Body& body, std::size_t i, std::size_t n) {
  const auto keyPoseAt = [&](std::size_t at) {
    const KinematicTarget& target = body.kinematicTarget;
    if (!body.moved) return body.drive.pose;
    if (target.segments == n) return target.keyPoses[at];
    return interpolateJointPose(target.keyPoses[0], target.keyPoses[1],
                                static_cast<double>(at) / static_cast<double>(n));
  };
  const JointPose from = keyPoseAt(i), to = keyPoseAt(i + 1);
  const collision::Pose pose = computeBodyPose(*body.spec, from);
  return {pose.rotation.toRotationMatrix(), pose.translation, to.offset - from.offset,
          body.spec->axis, to.angle - from.angle};
}

/// First contact of the two on their motions in this tick.
std::optional<Contact> findTransientTouch(const WorldData& world, const EntityPair& key,
                                          QueryCount& count) {
  const double contact = computeContactThreshold(world.settings);
  const collision::ContactOffset contactOffset{0.75 * contact, (1 - kRounding) * contact};
  const Body& body = *findKinematicBody(world, key.first);
  const Body* other = findKinematicBody(world, key.second);
  const PartPairs pairs = findPartPairsInRange(world, key, contact);
  const std::size_t n =
      std::max(body.kinematicTarget.segments, other ? other->kinematicTarget.segments : 1);
  for (std::size_t i = 0; i < n; ++i) {
    const collision::ScrewMotion motion = makeSegmentMotion(body, i, n);
    const collision::ScrewMotion otherMotion =
        other ? makeSegmentMotion(*other, i, n) : collision::ScrewMotion();
    collision::MotionResult earliest;
    for (const auto& [a, b] : pairs) {
      const collision::MovingShape part{makeConvexShape(body.shape->parts[a]), motion};
      collision::FeatureCache cache;
      const collision::MotionResult cast =
          other
              ? collision::castShape(
                    part,
                    collision::MovingShape{makeConvexShape(other->shape->parts[b]), otherMotion},
                    contactOffset, cache)
              : collision::castShape(part, world.scene->collisionGeometry(key.second - 1).convex(b),
                                     contactOffset, cache);
      count.add(cast);
      const bool reached =
          !cast.isClear() && collision::isWithin(cast.separation, contactOffset.rest);
      if (reached && cast.lo < earliest.lo) earliest = cast;
    }
    if (!earliest.isClear()) {
      Contact touch;
      touch.other = key.second;
      touch.touching = true;
      touch.separation = earliest.separation;
      return touch;
    }
  }
  return std::nullopt;
}

}  // namespace

KinematicContacts findKinematicContacts(WorldData& world, const ContactDistances& distances,
                                        QueryCount& count) {
  KinematicContacts contacts;
  for (const EntityPair& key : collectMovedPairs(world)) {
    const Contact* before = world.findBodyContact(key);
    const bool lasted = before != nullptr;
    if (!lasted && !mayTouch(world, key, distances.reportLimit)) continue;
    if (isExcluded(world, key, distances.contact)) continue;
    const double travel = computeMaxTravel(world, key.first) + computeMaxTravel(world, key.second);
    const double within = std::max(distances.reportLimit, distances.contact + travel);
    makePartBoxes(world, key);
    const auto found = computeContact(world, key, lasted ? kUnlimitedDistance : within, count);
    if (!found) continue;
    const double distance = found->separation.distance;
    std::optional<Contact> transient;
    if (!found->touching && !(lasted && before->touching) && distance < distances.contact + travel)
      transient = findTransientTouch(world, key, count);
    if (transient) contacts.transient.emplace_back(key, *transient);
    if (lasted || transient || found->touching || distance < distances.reportLimit)
      contacts.current.emplace_back(key, *found);
  }
  return contacts;
}

}  // namespace enfilade::scene
