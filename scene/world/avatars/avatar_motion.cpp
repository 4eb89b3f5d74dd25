// How an avatar moves in one tick: collide and slide (up to kSlides planes), steps up to
// Lengths::stepHeight, follows the ground down by as much, falls otherwise. Every piece of the way
// is swept, so that nothing is crossed at any speed, and each ends epsilon away from what stopped
// it. No move leaves the box that the avatar announced to the broad phase: a slide that would, as
// after a fast fall onto a steep roof, goes on in the next tick. Sliding is a declared policy
// (Lengths::sliding): what is left of a move after a stop goes on along the plane, or is not made.
// Who flies is swept in all directions and feels neither ground nor gravity.
#include <algorithm>
#include <cmath>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

constexpr int kSlides = 5;            // planes met in one move: a corner of three and two to spare
constexpr double kNoMove = 1e-9;      // of epsilon: what is left of a move below this is not made
constexpr double kTread = 0.05;       // metres: what is less deep, as a skirting board, is no step
constexpr double kWorthAStep = 1e-3;  // of the wish: a step must win at least this much ground

/// One avatar's motion through one tick.
struct Mover {
  const Lengths& lengths;
  Avatar& avatar;
  QueryCount& count;
  Vec3 feet;
  Box feetRoom;  ///< the feet stay in here, so that the body stays inside Avatar::reach

  collision::StoppingBand band() const { return bandOf(lengths); }
  bool walkable(const Vec3& normal) const { return normal.y() >= lengths.walkableNormalY; }
};

struct SlideResult {
  Stop steep;           ///< the first thing met that cannot be walked on, if any
  EntityId ground = 0;  ///< the last thing met that can
};

Stop sweepFrom(Mover& m, const Vec3& displacement) {
  const double part = partInside(m.feetRoom, m.feet, displacement);
  const Vec3 granted = part * displacement;
  Stop stop = sweepShape(*m.avatar.shape, m.feet, granted, m.avatar.obstacles, m.band(), m.count);
  m.feet += stop.fraction * granted;
  stop.fraction *= part;
  return stop;
}

/// `wish` with all parts into the planes removed: along one plane if that suits all others, else
/// along the crease of two, else nothing.
Vec3 alongPlanes(const Vec3& wish, const std::vector<Vec3>& normals) {
  const auto suitsAll = [&](const Vec3& move) {
    for (const Vec3& n : normals)
      if (move.dot(n) < -1e-12 * wish.norm()) return false;
    return true;
  };
  for (std::size_t i = normals.size(); i-- > 0;) {
    const Vec3 move = wish - std::min(0.0, wish.dot(normals[i])) * normals[i];
    if (suitsAll(move)) return move;
  }
  for (std::size_t i = normals.size(); i-- > 0;) {
    for (std::size_t j = i; j-- > 0;) {
      const Vec3 crease = normals[i].cross(normals[j]);
      const double squared = crease.squaredNorm();
      if (!(squared > 1e-12)) continue;
      const Vec3 move = (wish.dot(crease) / squared) * crease;
      if (suitsAll(move)) return move;
    }
  }
  return Vec3::Zero();
}

/// A walker does not climb what is steep nor duck under what leans over it: such planes act as
/// upright walls.
Vec3 planeForWalking(const Mover& m, const Vec3& normal) {
  if (m.walkable(normal)) return normal;
  const Vec3 upright{normal.x(), 0, normal.z()};
  const double length = upright.norm();
  return length > 1e-6 ? Vec3(upright / length) : normal;
}

/// How a move goes on after a stop.
enum class Manner : std::uint8_t {
  walk,  ///< up slopes that can be walked on; what is steep acts as an upright wall
  drop,  ///< straight down to the first thing that can be stood on, sliding off what is steep
  fall,  ///< as drop, but what is left of the move across the ground is still made
  fly    ///< nothing is ground
};

/// What is left of a move after it met a plane that can be stood on.
Vec3 afterGround(const Vec3& rest, Manner manner) {
  switch (manner) {
    case Manner::walk:
      return rest;
    case Manner::drop:
      return Vec3::Zero();
    default:
      return {rest.x(), 0, rest.z()};
  }
}

/// What is left of a move after it met a plane that cannot: gravity goes on whatever the policy.
Vec3 afterSteep(const Vec3& rest, Manner manner, Sliding sliding) {
  if (sliding == Sliding::slide || manner == Manner::drop) return rest;
  return manner == Manner::fall ? Vec3(0, std::min(0.0, rest.y()), 0) : Vec3(Vec3::Zero());
}

/// Moves by `wish`, sliding along what is met. What is left of the wish itself is put along the
/// planes, not what an earlier plane made of it: that may point against the wish, and who stands in
/// a notch would go to and fro in it for ever.
SlideResult slide(Mover& m, const Vec3& wish, Manner manner) {
  SlideResult result;
  std::vector<Vec3> planes;
  const double enough = kNoMove * m.lengths.epsilon;
  Vec3 rest = wish, move = wish;
  for (int i = 0; i < kSlides && move.norm() > enough; ++i) {
    const Stop stop = sweepFrom(m, move);
    if (stop.entity == 0) break;
    rest *= 1 - stop.fraction;
    if (manner != Manner::fly && m.walkable(stop.normal)) {
      result.ground = stop.entity;
      rest = afterGround(rest, manner);
    } else {
      if (result.steep.entity == 0) result.steep = stop;
      rest = afterSteep(rest, manner, m.lengths.sliding);
    }
    planes.push_back(manner == Manner::walk ? planeForWalking(m, stop.normal) : stop.normal);
    move = alongPlanes(rest, planes);
    // Back out to epsilon where grazing moves came nearer.
    move += std::max(0.0, m.lengths.epsilon - stop.distance) * planes.back();
  }
  return result;
}

/// Lets the feet down by at most `depth` onto something walkable and returns that; 0 (and unmoved)
/// if there is nothing such.
EntityId settle(Mover& m, double depth) {
  const Vec3 before = m.feet;
  const EntityId ground = slide(m, {0, -depth, 0}, Manner::drop).ground;
  if (ground == 0) m.feet = before;
  return ground;
}

double progress(const Vec3& from, const Vec3& to, const Vec3& direction) {
  return (to - from).dot(direction);
}

/// Whether the way goes on for at least half a tread beyond `gained`; the feet stay.
bool hasTread(Mover& m, const Vec3& direction, double gained) {
  const Vec3 before = m.feet;
  slide(m, (gained + kTread) * direction, Manner::walk);
  const double room = progress(before, m.feet, direction);
  m.feet = before;
  return room > gained + 0.5 * kTread;
}

/// How high the feet go for a step: the rest of it a prism glides up its bevel.
double liftOf(const Mover& m) {
  const Avatar& avatar = m.avatar;
  const bool isPrism = avatar.standing > 0;
  return m.lengths.stepHeight - (isPrism ? bevelOf(avatar.radius, avatar.standing, m.lengths) : 0);
}

/// Tries the wish one step higher; true if that wins ground and ends on something walkable.
bool stepUp(Mover& m, const Vec3& start, const Vec3& wish, double toBeat) {
  const Vec3 low = m.feet;
  m.feet = start;
  sweepFrom(m, {0, liftOf(m), 0});
  const double raised = m.feet.y() - start.y();
  const double length = wish.norm();
  if (hasTread(m, wish / length, toBeat)) {
    slide(m, wish, Manner::walk);
    if (settle(m, raised + m.lengths.epsilon) != 0 &&
        progress(start, m.feet, wish / length) > toBeat + kWorthAStep * length)
      return true;
  }
  m.feet = low;
  return false;
}

void stoppedBy(Avatar& avatar, const Stop& stop) {
  avatar.stoppedBy = stop.entity;
  avatar.atStop = stop.atStop;
}

void standOn(Avatar& avatar, EntityId ground) {
  avatar.standsOn = ground;
  avatar.grounded = ground != 0;
}

void walkOnGround(Mover& m, const Vec3& wish) {
  const Vec3 start = m.feet;
  const double length = wish.norm();
  Stop steep;
  if (length > 0) {
    steep = slide(m, wish, Manner::walk).steep;
    const double gained = progress(start, m.feet, wish / length);
    if (steep.entity != 0 && stepUp(m, start, wish, gained)) steep = {};
  }
  standOn(m.avatar, settle(m, m.lengths.stepHeight));
  m.avatar.fallSpeed = 0;
  stoppedBy(m.avatar, steep);
}

/// The speed of a fall after a tick that asked for `asked` metres downwards and got `made`: what
/// holds up a fall, or meets the head of one who rises, takes its speed.
double speedAfter(double speed, double asked, double made, double tick) {
  constexpr double kHeldUp = 0.99;  // of the way: less than that is not the rounding of a slide
  const bool heldUp = asked > 0 ? made < kHeldUp * asked : made > kHeldUp * asked;
  if (!heldUp) return speed;
  return speed > 0 ? std::min(speed, std::max(0.0, made / tick)) : 0;
}

/// Falls, or rises after a jump: exactly on the parabola, tick by tick.
void fall(Mover& m, const Vec3& wish) {
  const Lengths& l = m.lengths;
  const double before = m.avatar.fallSpeed;
  const double after = std::min(before + l.gravity * l.tick, l.speedLimit);
  const double down = 0.5 * (before + after) * l.tick;
  const double height = m.feet.y();
  const SlideResult met = slide(m, wish - Vec3(0, down, 0), Manner::fall);
  stoppedBy(m.avatar, met.steep);
  standOn(m.avatar, met.ground);
  const double made = height - m.feet.y();
  m.avatar.fallSpeed = m.avatar.grounded ? 0 : speedAfter(after, down, made, l.tick);
}

void fly(Mover& m, const Vec3& wish) {
  m.avatar.fallSpeed = 0;
  standOn(m.avatar, 0);
  stoppedBy(m.avatar, slide(m, wish, Manner::fly).steep);
}

}  // namespace

Box feetRoomOf(const Lengths& lengths, const Avatar& avatar) {
  return feetRoomIn(avatar.reach, avatar.shape->box,
                    lookoutOf(lengths) + chainReach(avatar.chain, lengths.tick));
}

Box reachOf(const WorldState& world, const Avatar& avatar, const Vec3& velocity) {
  const Lengths& l = world.lengths;
  const double across = velocity.norm() * l.tick + kTread + chainReach(avatar.chain, l.tick);
  const double down = (std::abs(avatar.fallSpeed) + l.gravity * l.tick) * l.tick;
  // Slides back out by epsilon, contacts and near misses look a little further.
  const double margin = 8 * l.epsilon + l.nearMiss;
  Box box = boxAt(avatar.shape->box, avatar.feet);
  box.min -= Vec3(across, across + std::max(l.stepHeight, down), across);
  box.max += Vec3(across, across + std::max(l.stepHeight, down), across);
  return grown(box, margin);
}

void moveAvatar(WorldState& world, Avatar& avatar, const Vec3& velocity, QueryCount& count) {
  Mover m{world.lengths, avatar, count, avatar.feet, feetRoomOf(world.lengths, avatar)};
  const Vec3 wish = velocity * world.lengths.tick;
  if (avatar.flying) {
    fly(m, wish);
  } else if (avatar.grounded) {
    walkOnGround(m, wish);
  } else {
    fall(m, wish);
  }
  avatar.asked = wish;
  avatar.lastMove = m.feet - avatar.feet;
  avatar.feet = m.feet;
  avatar.stirred = false;
  if (avatar.chain.speed > 0) moveJoints(world, avatar, count);
}

}  // namespace enfilade::scene
