// How doors, lifts and things on paths move: each in turn, in the order of the model, swept against
// the avatars where these stand now. (Free bodies give way in the solver, or are pushed there;
// driven ones are not asked for by one another.)
//  0. Of a path each stretch between two of its places is gone by itself, straight and evenly.
//  1. Riders that the body would lift go first; what it leaves behind follows it afterwards.
//  2. The body goes until it comes near something, or until a free body does that rests on it and
//     rises with it (the solver will lift that when avatars have moved). What is met is pushed
//     along the normal by as much as the body still needs, by a sweep of its own, so that a push
//     crosses nothing.
//  3. Where that gains nothing, the body stops and says so; it tries again in the next tick.
// Still objects stop no kinematic body: its limits say where it may go, and doors touch their
// frames as drawn.
#include <algorithm>
#include <cmath>
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

/// Where an avatar goes that must give way by `distance` along `normal`: across the ground, unless
/// it is pushed up or down.
Vec3 yieldingWay(const Vec3& normal, double distance) {
  if (std::abs(normal.y()) >= kSidewards) return distance * normal;
  const Vec3 level{normal.x(), 0, normal.z()};
  const double length = level.norm();
  return distance / (length * length) * level;
}

/// A free body that rests on the body, or on such a one. It is taken to rise as its middle is
/// carried, straight up: what tilts, or is held, is left to the solver.
struct Load {
  std::uint32_t index;             ///< into WorldState::bodies
  Vec3 middle;                     ///< in the carrier's frame
  double height;                   ///< of the middle, when the tick began
  double risen;                    ///< metres, by other driven bodies in this tick
  double rise = 0;                 ///< metres, with the carrier so far
  double toRise = 0;               ///< metres, on the way at hand
  std::vector<Avatar*> near = {};  ///< whom it may meet

  /// Where it is already; the way at hand may end below.
  double from() const { return std::max(rise, risen); }
  bool isLifted() const { return rise + toRise > from(); }
};

/// Moves the avatar by `wish` as far as it can, sliding along what is met. What rises with the body
/// is in nobody's way upwards.
void shove(WorldState& world, Avatar& avatar, Vec3 wish, const std::vector<Load>& loads,
           QueryCount& count) {
  gatherObstacles(world, avatar);
  if (wish.y() > 0)
    for (Obstacle& obstacle : avatar.obstacles)
      if (std::ranges::find(loads, obstacle.ofBody, &Load::index) != loads.end())
        obstacle.box = Box();
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

/// Who stops the body, and where.
struct Encounter {
  Avatar* avatar = nullptr;
  const Load* load = nullptr;  ///< that met the avatar; null: the body itself
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
        first = {&avatar, nullptr, sweep};
    }
  }
}

/// The same of a load that is lifted.
void meet(const Load& load, Avatar& avatar, const WorldState& world, Encounter& first,
          QueryCount& count) {
  const collision::StoppingBand band = bandOf(world.lengths);
  const Body& body = world.bodies[load.index];
  const double from = load.from(), rise = load.rise + load.toRise - from;
  const Vec3 risen(0, from, 0);
  const BodyWay way{body.rotation, Vec3(body.position + risen), {0, rise, 0}, Vec3::UnitY(), 0};
  for (const AvatarPart& limb : avatar.shape->parts) {
    Box box = grown(boxAt(limb.box, avatar.feet), band.high + rise);
    box.min -= risen, box.max -= risen;
    for (std::size_t part = 0; part < body.partBoxes.size(); ++part) {
      if (!overlaps(box, body.partBoxes[part])) continue;
      BodySweep sweep =
          sweepTurning({body.shape->parts[part], way}, bodyAt(limb, avatar.feet), band, count);
      if (!sweep.stopped) continue;
      sweep.fraction = (from + sweep.fraction * rise - load.rise) / load.toRise;
      if (!first.avatar || sweep.fraction < first.sweep.fraction) first = {&avatar, &load, sweep};
    }
  }
}

/// Which free body stands on which body: the lower one first; ascending.
using Supports = std::vector<std::pair<EntityId, EntityId>>;

/// The steepest normal of parts that touch, from `a` to `b`: of a crate in a corner the nearest
/// part may be the wall.
double steepestTouch(const WorldState& world, const Body& a, const Body& b) {
  double steepest = 0;
  const double near = contactLimit(world.lengths);
  for (std::uint32_t i = 0; i < a.partBoxes.size(); ++i) {
    const Box box = grown(a.partBoxes[i], near);
    for (std::uint32_t k = 0; k < b.partBoxes.size(); ++k) {
      if (!overlaps(box, b.partBoxes[k])) continue;
      collision::FeatureCache cache;
      const auto at = collision::decideWithin(partOf(a, i), partOf(b, k), near, cache);
      const bool touches = at && at->verdict != collision::Verdict::penetrating;
      if (touches && std::abs(at->normal.y()) > std::abs(steepest)) steepest = at->normal.y();
    }
  }
  return steepest;
}

/// Whether the second stands on the first, > 0, or the first on the second, < 0; by the contact of
/// the last tick.
double standing(const WorldState& world, const Contact& contact, const Body& first,
                const Body& second) {
  const double least = world.lengths.walkableNormalY;
  if (contact.decision.verdict == collision::Verdict::penetrating)  // there is no normal
    return second.position.y() - first.position.y();
  double up = contact.decision.normal.y();
  const bool isOne = first.partBoxes.size() == 1 && second.partBoxes.size() == 1;
  if (std::abs(up) < least && !isOne) up = steepestTouch(world, first, second);
  return std::abs(up) < least ? 0 : up;
}

/// Of the last tick. None where there is nobody whom they could lift.
Supports supportsOf(const WorldState& world) {
  Supports supports;
  if (world.avatars.empty() || world.goingBodies.empty()) return supports;
  for (const auto& [pair, contact] : world.bodyContacts) {
    if (!contact.touching || pair.second >= world.firstAvatarId()) continue;
    const auto first = world.bodyOfId.find(pair.first), second = world.bodyOfId.find(pair.second);
    if (first == world.bodyOfId.end() || second == world.bodyOfId.end()) continue;
    const Body &a = world.bodies[first->second], &b = world.bodies[second->second];
    const double up = standing(world, contact, a, b);
    const Body &below = up > 0 ? a : b, &above = up > 0 ? b : a;
    const bool carries = up != 0 && above.spec->kind == BodyKind::rigid && !above.left;
    if (carries) supports.emplace_back(below.id, above.id);
  }
  std::ranges::sort(supports);
  return supports;
}

std::vector<Load> loadsOf(const WorldState& world, const Body& body, const Supports& supports) {
  std::vector<Load> loads;
  std::vector<EntityId> open{body.id};
  std::set<EntityId> known{body.id};
  while (!open.empty()) {
    const EntityId below = open.back();
    open.pop_back();
    for (auto at = std::ranges::lower_bound(supports, std::pair(below, EntityId{0}));
         at != supports.end() && at->first == below; ++at) {
      if (!known.insert(at->second).second) continue;
      open.push_back(at->second);
      const std::uint32_t index = world.bodyOfId.at(at->second);
      const Body& above = world.bodies[index];
      loads.push_back({index, inBody(body, above.position), above.position.y(), above.risesBy});
    }
  }
  return loads;
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
  Vec3 contact;         ///< on the body, in its frame
  bool onLoad;          ///< stands on a load, not on the body itself
  bool lifted = false;  ///< all of the way at hand: no load comes nearer
};

/// Who goes with the driven body in this tick, or may be in its way.
struct Company {
  std::vector<Load> loads;  ///< near somebody
  std::vector<Avatar*> near;
  std::vector<Rider> riders;
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

bool standsOn(const WorldState& world, const Body& body, const Avatar& avatar, Vec3& at) {
  for (const Contact& contact : avatar.contacts) {
    const bool below = -contact.decision.normal.y() >= world.lengths.walkableNormalY;
    if (contact.other != body.id || !contact.touching || !below) continue;
    at = leaningPoint(world, body, avatar, contact);
    return true;
  }
  return false;
}

Company companyOf(WorldState& world, const Body& body, const Supports& supports) {
  Company company{loadsOf(world, body, supports), avatarsNear(world, body), {}};
  Vec3 at;
  for (Avatar* avatar : company.near)
    if (avatar->grounded && standsOn(world, body, *avatar, at))
      company.riders.push_back({avatar, inBody(body, at), false});
  const std::size_t direct = company.riders.size();
  for (Load& load : company.loads) {
    const Body& loaded = world.bodies[load.index];
    load.near = avatarsNear(world, loaded);
    for (Avatar* avatar : load.near) {
      if (!avatar->grounded || avatar->standsOn != loaded.id) continue;
      const auto end = company.riders.begin() + static_cast<std::ptrdiff_t>(direct);
      if (std::find_if(company.riders.begin(), end,
                       [&](const Rider& rider) { return rider.avatar == avatar; }) == end)
        company.riders.push_back({avatar, inBody(body, avatar->feet), true});
    }
  }
  std::erase_if(company.loads, [](const Load& load) { return load.near.empty(); });
  return company;
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
          const std::vector<Load>& loads, QueryCount& count) {
  const collision::Decision& at = met.sweep.atStop;
  if (at.verdict != collision::Verdict::separated) return false;
  const double left = 1 - met.sweep.fraction;  // of a load's way; the body itself has gone its part
  const Vec3 way = met.load ? Vec3(0, left * met.load->toRise, 0)
                            : Vec3(carried(body, to, at.pointA) - at.pointA);
  const double needed = at.normal.dot(way);
  const double apart = std::max(0.0, bandOf(world.lengths).high - at.distance);
  const Vec3 before = met.avatar->feet;
  shove(world, *met.avatar, yieldingWay(at.normal, std::max(0.0, needed) + apart), loads, count);
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

/// How far the loads have risen, which is where they stand from now on, and will on the way to
/// `to`.
void follow(WorldState& world, const Body& body, const BodyPlace& to, std::vector<Load>& loads) {
  if (loads.empty()) return;
  const collision::Pose pose = poseAt(*body.spec, to);
  const Mat3 rotation = pose.rotation.toRotationMatrix();
  for (Load& load : loads) {
    const double height = (body.rotation * load.middle + body.position).y();
    load.rise = height - load.height;
    load.toRise = (rotation * load.middle + pose.translation).y() - height;
    world.bodies[load.index].risesBy = std::max(load.from(), 0.0);
  }
}

bool isLifted(const Company& company, const Avatar& avatar) {
  return std::ranges::any_of(
      company.riders, [&](const Rider& rider) { return rider.avatar == &avatar && rider.lifted; });
}

/// Goes on, pushing, until the body is at `to` or blocked; what part of the way was made.
double advance(WorldState& world, Body& body, const BodyPlace& to, Company& company,
               TickReport& report, QueryCount& count) {
  double left = 1;
  Encounter met;
  for (int i = 0; i < kPushes; ++i) {
    met = {};
    const BodyWay way = wayOf(body, to);
    const double farthest = farthestWay(*body.shape, body.drive.place, to);
    follow(world, body, to, company.loads);
    for (Avatar* avatar : company.near) meet(body, way, farthest, *avatar, world, met, count);
    for (const Load& load : company.loads)
      for (Avatar* avatar : load.near)
        if (load.isLifted() && !isLifted(company, *avatar)) meet(load, *avatar, world, met, count);
    commit(body, to, met.sweep.fraction);
    left *= 1 - met.sweep.fraction;
    if (!met.avatar) return 1;
    if (!push(world, body, to, met, company.loads, count)) break;
    if (i + 1 == kPushes) ++count.bounded;
  }
  tellBlocked(world, body, met, report);
  return 1 - left;
}

/// Goes as advance(), and who stands on the body, or on its loads, goes along. A load settles by
/// itself, and who stands on it after it.
double advanceWithRiders(WorldState& world, Body& body, const BodyPlace& to, Company& company,
                         TickReport& report, QueryCount& count) {
  std::vector<Vec3> before;
  for (Rider& rider : company.riders) {
    before.push_back(body.rotation * rider.contact + body.position);
    const Vec3 way = carried(body, to, before.back()) - before.back();
    const double low = rider.avatar->feet.y();
    if (way.y() > 0) shove(world, *rider.avatar, way, company.loads, count);
    const double risen = rider.avatar->feet.y() - low;
    rider.lifted = way.y() > 0 && risen >= way.y() - kYield * world.lengths.epsilon;
  }
  const double made = advance(world, body, to, company, report, count);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Rider& rider = company.riders[i];
    Vec3 way = body.rotation * rider.contact + body.position - before[i];
    if (way.y() > 0) continue;
    if (rider.onLoad) way.y() = 0;
    shove(world, *rider.avatar, way, company.loads, count);
  }
  return made;
}

/// Goes the plan's stretches until one is blocked; what part of the plan was made. What it did not
/// reach is where it stays.
double followPlan(WorldState& world, Body& body, Company& company, TickReport& report,
                  QueryCount& count) {
  BodyPlan& plan = body.plan;
  for (std::size_t i = 0; i < plan.stretches; ++i) {
    const double made = advanceWithRiders(world, body, plan.places[i + 1], company, report, count);
    if (made == 1) continue;
    std::fill(plan.places.begin() + static_cast<std::ptrdiff_t>(i) + 1, plan.places.end(),
              body.drive.place);
    return (static_cast<double>(i) + made) / static_cast<double>(plan.stretches);
  }
  body.blockedBy = 0;
  return 1;
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

void moveBody(WorldState& world, Body& body, const Supports& supports, TickReport& report,
              QueryCount& count) {
  const Vec3 before = body.position;
  const double tick = world.lengths.tick;
  Company company = companyOf(world, body, supports);
  arrive(body, followPlan(world, body, company, report, count), tick);
  follow(world, body, body.drive.place, company.loads);
  body.velocity = (body.position - before) / tick;
  body.spin = (body.drive.place.turn - body.plan.places[0].turn) / tick * body.spec->axis;
}

}  // namespace

void moveBodies(WorldState& world, TickReport& report, QueryCount& count) {
  const Supports supports = supportsOf(world);
  for (const std::uint32_t index : world.goingBodies)
    moveBody(world, world.bodies[index], supports, report, count);
}

}  // namespace enfilade::scene
