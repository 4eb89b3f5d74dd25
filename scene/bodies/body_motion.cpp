// How doors, lifts and things on paths move: each in turn, in the order of the model, swept against
// the avatars where these stand now. (Free bodies give way in the solver, or are pushed there;
// driven ones are not asked for by one another.)
//  0. Of a path each stretch between two of its places is gone by itself, straight and evenly.
//  1. Riders that the body would lift go first, also those that stand on a free body upon it; what
//     it leaves behind follows it afterwards.
//  2. The body goes until it comes near something. That is pushed along the normal by as much as
//     the body still needs, by a sweep of its own, so that a push crosses nothing.
//  3. Where that gains nothing, the body stops and says so; it tries again in the next tick.
// Still objects stop no kinematic body: its limits say where it may go, and doors touch their
// frames as drawn.
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "collision/contact_manifold.hpp"
#include "scene/bodies/body_sweep.hpp"
#include "scene/world_state.hpp"

namespace enfilade::scene {
namespace {

constexpr int kPushes = 64;         // on one stretch of one body
constexpr int kPushSlides = 3;      // planes along which one push goes on
constexpr double kYield = 1e-3;     // of epsilon: a push that gains less is none
constexpr double kSidewards = 0.7;  // |normal.y| below which a push stays level

BodyWay wayOf(const Body& body, const BodyPlace& to) {
  const BodyPlace& from = body.drive.place;
  return {body.rotation, body.position, to.offset - from.offset, body.spec->axis,
          to.turn - from.turn};
}

/// A point of the scene's frame in the body's.
Vec3 inBody(const Body& body, const Vec3& point) {
  return body.rotation.transpose() * (point - body.position);
}

/// Where a point that moves with the body would come to.
Vec3 carried(const Body& body, const BodyPlace& to, const Vec3& point) {
  const collision::Pose pose = poseAt(*body.spec, to);
  return pose.rotation.toRotationMatrix() * inBody(body, point) + pose.translation;
}

/// Moves the avatar by `wish` as far as it can, sliding along what is met.
void shove(WorldState& world, Avatar& avatar, Vec3 wish, QueryCount& count) {
  gatherObstacles(world, avatar);
  const Box room = feetRoomOf(world.lengths, avatar);
  avatar.stirred = true;  // who was moved looks where it stands now, even if the body then stays
  for (int i = 0; i < kPushSlides && !wish.isZero(0); ++i) {
    const Vec3 granted = partInside(room, avatar.feet, wish) * wish;
    const Stop stop = sweepShape(*avatar.shape, avatar.feet, granted, avatar.obstacles,
                                 bandOf(world.lengths), count);
    avatar.feet += stop.fraction * granted;
    if (stop.entity == 0) return;
    const Vec3 rest = (1 - stop.fraction) * granted;
    wish = rest - std::min(0.0, rest.dot(stop.normal)) * stop.normal;
  }
}

/// Where an avatar goes that must give way by `distance` along `normal`: across the ground, unless
/// it is pushed up or down.
Vec3 yieldingWay(const Vec3& normal, double distance) {
  if (std::abs(normal.y()) >= kSidewards) return distance * normal;
  const Vec3 level{normal.x(), 0, normal.z()};
  const double length = level.norm();
  return distance / (length * length) * level;
}

/// Who stops the body, and where.
struct Encounter {
  Avatar* avatar = nullptr;
  BodySweep sweep;
};

void meet(const Body& body, const BodyWay& way, double farthest, Avatar& avatar,
          const WorldState& world, Encounter& first, QueryCount& count) {
  const collision::StoppingBand band = bandOf(world.lengths);
  for (const AvatarPart& limb : avatar.shape->parts) {
    const Box box = grown(boxAt(limb.box, avatar.feet), band.high + farthest);
    for (std::size_t part = 0; part < body.partBoxes.size(); ++part) {
      if (!overlaps(box, body.partBoxes[part])) continue;
      const BodySweep sweep =
          sweepTurning({body.shape->parts[part], way}, bodyAt(limb, avatar.feet), band, count);
      if (sweep.stopped && (!first.avatar || sweep.fraction < first.sweep.fraction))
        first = {&avatar, sweep};
    }
  }
}

/// Avatars that the broad phase has near the body, in order of name.
std::vector<Avatar*> avatarsNear(WorldState& world, const Body& body) {
  std::vector<std::string> names;
  for (const auto& partner : world.broadPhase.partners(body.mover)) {
    if (!partner.moves) continue;
    const auto found = world.avatarOfMover.find(partner.id);
    if (found != world.avatarOfMover.end()) names.push_back(found->second);
  }
  std::sort(names.begin(), names.end());
  std::vector<Avatar*> avatars;
  for (const std::string& name : names) avatars.push_back(&world.avatars.at(name));
  return avatars;
}

struct Rider {
  Avatar* avatar;
  Vec3 contact;       ///< on the body, in its frame
  bool onFree;        ///< stands on a free body that the body carries
  double height = 0;  ///< of the contact in the beginning
};

/// Where the avatar leans on the body, as near to its feet as that comes: carried by that point,
/// who stands on what turns goes round with its feet, and who has a finger on it with the finger.
Vec3 leaningPoint(const WorldState& world, const Body& body, const Avatar& avatar,
                  const Contact& contact) {
  const double near = contactLimit(world.lengths);
  Box patch{contact.decision.pointB, contact.decision.pointB};
  for (const AvatarPart& limb : avatar.shape->parts) {
    const Box box = grown(boxAt(limb.box, avatar.feet), near);
    for (std::uint32_t i = 0; i < body.partBoxes.size(); ++i) {
      if (!overlaps(box, body.partBoxes[i])) continue;
      const collision::ConvexBody own = bodyAt(limb, avatar.feet), under = partOf(body, i);
      collision::FeatureCache cache;
      const collision::Decision at = collision::decide(own, under, cache);
      if (at.verdict != collision::Verdict::separated || at.distance >= near) continue;
      if (-at.normal.y() < world.lengths.walkableNormalY) continue;
      const collision::ContactManifold manifold = collision::contactManifold(
          own, under,
          {at.normal, at.pointA, at.pointB, near, collision::ContactManifold::kMostPoints});
      for (const collision::ContactPoint& point : manifold.list()) patch.include(point.pointB);
    }
  }
  return avatar.feet.cwiseMax(patch.min).cwiseMin(patch.max);
}

/// The free bodies that the body carries: those that rest on it, or on such a one.
std::set<EntityId> carriedBy(const WorldState& world, const Body& body) {
  std::set<EntityId> carried{body.id};
  for (std::size_t before = 0; before < carried.size();) {
    before = carried.size();
    for (const auto& [pair, contact] : world.bodyContacts) {
      const double upwards = contact.decision.normal.y();  // from the first to the second
      if (!contact.touching || std::abs(upwards) < world.lengths.walkableNormalY) continue;
      const EntityId below = upwards > 0 ? pair.first : pair.second;
      const EntityId above = upwards > 0 ? pair.second : pair.first;
      const auto found = world.bodyOfId.find(above);
      if (found == world.bodyOfId.end()) continue;
      const bool isFree = world.bodies[found->second].spec->kind == BodyKind::rigid;
      if (isFree && carried.contains(below)) carried.insert(above);
    }
  }
  return carried;
}

/// Who stands on a free body that the body may carry or push.
std::vector<Avatar*> avatarsOnFree(WorldState& world) {
  std::vector<Avatar*> avatars;
  for (auto& [name, avatar] : world.avatars) {
    const auto ground = world.bodyOfId.find(avatar.standsOn);
    if (ground != world.bodyOfId.end() && world.bodies[ground->second].driven)
      avatars.push_back(&avatar);
  }
  return avatars;
}

/// Who stands on the body, and on what it carries.
std::vector<Rider> ridersOf(WorldState& world, const Body& body, const std::vector<Avatar*>& near) {
  std::vector<Rider> riders;
  for (Avatar* avatar : near) {
    if (!avatar->grounded) continue;
    for (const Contact& contact : avatar->contacts) {
      const bool below = -contact.decision.normal.y() >= world.lengths.walkableNormalY;
      if (contact.other == body.id && contact.touching && below)
        riders.push_back(
            {avatar, inBody(body, leaningPoint(world, body, *avatar, contact)), false});
    }
  }
  const std::vector<Avatar*> onFree = avatarsOnFree(world);
  if (onFree.empty()) return riders;
  const std::set<EntityId> carried = carriedBy(world, body);
  for (Avatar* avatar : onFree)
    if (carried.contains(avatar->standsOn) &&
        std::ranges::find(riders, avatar, &Rider::avatar) == riders.end())
      riders.push_back({avatar, inBody(body, avatar->feet), true, avatar->feet.y()});
  return riders;
}

void commit(Body& body, const BodyPlace& to, double fraction) {
  BodyPlace& place = body.drive.place;
  if (fraction == 1) {
    place = to;
  } else {
    place = placeBetween(place, to, fraction);
  }
  const collision::Pose pose = poseAt(*body.spec, place);
  placeBody(body, pose.translation, pose.rotation);
  body.moved = body.moved || (fraction > 0 && body.plan.farthest > 0);
}

/// Pushes who is in the way; false when that gains the body nothing.
bool push(WorldState& world, const Body& body, const BodyPlace& to, const Encounter& met,
          QueryCount& count) {
  const collision::Decision& at = met.sweep.atStop;
  if (at.verdict != collision::Verdict::separated) return false;
  const double needed = at.normal.dot(carried(body, to, at.pointA) - at.pointA);
  const double apart = std::max(0.0, bandOf(world.lengths).high - at.distance);
  const Vec3 before = met.avatar->feet;
  shove(world, *met.avatar, yieldingWay(at.normal, std::max(0.0, needed) + apart), count);
  return (met.avatar->feet - before).dot(at.normal) > kYield * world.lengths.epsilon;
}

void tellBlocked(const WorldState& world, Body& body, const Encounter& met, TickReport& report) {
  const bool told = body.blockedBy == met.avatar->id;
  body.blockedBy = met.avatar->id;
  body.drive.rate = 0;
  if (told) return;
  Contact contact;
  contact.other = met.avatar->id;
  contact.decision = met.sweep.atStop;
  report.contacts.push_back(eventOf(world, ContactEvent::Kind::blocked, body.id, contact));
}

/// Goes on, pushing, until the body is at `to` or blocked; what part of the way was made.
double advance(WorldState& world, Body& body, const BodyPlace& to, const std::vector<Avatar*>& near,
               TickReport& report, QueryCount& count) {
  double left = 1;
  Encounter met;
  for (int i = 0; i < kPushes; ++i) {
    met = {};
    const BodyWay way = wayOf(body, to);
    const double farthest = farthestWay(*body.shape, body.drive.place, to);
    for (Avatar* avatar : near) meet(body, way, farthest, *avatar, world, met, count);
    commit(body, to, met.sweep.fraction);
    left *= 1 - met.sweep.fraction;
    if (!met.avatar) return 1;
    if (!push(world, body, to, met, count)) break;
    if (i + 1 == kPushes) ++count.bounded;
  }
  tellBlocked(world, body, met, report);
  return 1 - left;
}

/// How the avatar and the body stand to one another.
collision::Decision decisionOf(const Body& body, const Avatar& avatar) {
  collision::Decision nearest;
  nearest.distance = std::numeric_limits<double>::infinity();
  for (std::uint32_t part = 0; part < body.partBoxes.size(); ++part) {
    for (const AvatarPart& limb : avatar.shape->parts) {
      collision::FeatureCache cache;
      const collision::Decision found =
          collision::decide(partOf(body, part), bodyAt(limb, avatar.feet), cache);
      if (nearer(found, nearest)) nearest = found;
    }
  }
  return nearest;
}

/// The same, and who stands on the body goes along. Who stands on what it carries and cannot be
/// lifted stops it.
double advanceWithRiders(WorldState& world, Body& body, const BodyPlace& to,
                         const std::vector<Avatar*>& near, const std::vector<Rider>& riders,
                         TickReport& report, QueryCount& count) {
  std::vector<Vec3> before;
  double part = 1;
  Encounter held;
  for (const Rider& rider : riders) {
    before.push_back(body.rotation * rider.contact + body.position);
    const Vec3 way = carried(body, to, before.back()) - before.back();
    if (!(way.y() > 0)) continue;
    const double low = rider.avatar->feet.y();
    shove(world, *rider.avatar, way, count);
    const double risen = rider.avatar->feet.y() - low;
    if (!rider.onFree || risen >= way.y() - kYield * world.lengths.epsilon) continue;
    part = std::min(part, std::max(0.0, risen / way.y()));
    held.avatar = rider.avatar;
  }
  const BodyPlace target = part < 1 ? placeBetween(body.drive.place, to, part) : to;
  double made = advance(world, body, target, near, report, count);
  if (held.avatar && made == 1) {
    held.sweep.atStop = decisionOf(body, *held.avatar);
    tellBlocked(world, body, held, report);
  }
  made *= part;
  for (std::size_t i = 0; i < riders.size(); ++i) {
    const Vec3 way = body.rotation * riders[i].contact + body.position - before[i];
    if (way.y() <= 0) shove(world, *riders[i].avatar, way, count);
  }
  return made;
}

/// Goes the plan's stretches until one is blocked; what part of the plan was made. What it did not
/// reach is where it stays.
double followPlan(WorldState& world, Body& body, TickReport& report, QueryCount& count) {
  const std::vector<Avatar*> near = avatarsNear(world, body);
  const std::vector<Rider> riders = ridersOf(world, body, near);
  BodyPlan& plan = body.plan;
  double part = 1;
  for (std::size_t i = 0; i < plan.stretches && part == 1; ++i) {
    const double made =
        advanceWithRiders(world, body, plan.places[i + 1], near, riders, report, count);
    if (made == 1) continue;
    std::fill(plan.places.begin() + static_cast<std::ptrdiff_t>(i) + 1, plan.places.end(),
              body.drive.place);
    part = (static_cast<double>(i) + made) / static_cast<double>(plan.stretches);
  }
  for (const Rider& rider : riders) {
    if (!rider.onFree) continue;
    const double risen = (body.rotation * rider.contact + body.position).y() - rider.height;
    rider.avatar->liftedBy =
        std::clamp(risen, 0.0, std::max(0.0, rider.avatar->feet.y() - rider.height));
  }
  if (part == 1) body.blockedBy = 0;
  return part;
}

void arrive(Body& body, double made, double tick) {
  BodyDrive& drive = body.drive;
  const double coordinate = body.plan.coordinate;
  if (made == 1)
    drive.coordinate = coordinate;
  else if (goesRound(*body.spec))
    drive.coordinate =
        std::fmod(drive.coordinate + made * drive.speed * tick, body.spec->keys.back().time);
  else
    drive.coordinate += made * (coordinate - drive.coordinate);
  drive.going = goesRound(*body.spec) || drive.coordinate != drive.target;
}

void moveBody(WorldState& world, Body& body, TickReport& report, QueryCount& count) {
  const Vec3 before = body.position;
  const double tick = world.lengths.tick;
  arrive(body, followPlan(world, body, report, count), tick);
  body.velocity = (body.position - before) / tick;
  body.spin = (body.drive.place.turn - body.plan.places[0].turn) / tick * body.spec->axis;
}

}  // namespace

void moveBodies(WorldState& world, TickReport& report, QueryCount& count) {
  for (const std::uint32_t index : world.goingBodies)
    moveBody(world, world.bodies[index], report, count);
}

}  // namespace enfilade::scene
