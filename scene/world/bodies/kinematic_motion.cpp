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

#include "scene/world/bodies/body_sweep.hpp"
#include "scene/world/bodies/passengers.hpp"

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
