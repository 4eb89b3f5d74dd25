#include "scene/world/contacts/obstacles.hpp"

#include <algorithm>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

constexpr double kGatherMargin = 0.15;  // metres: obstacles are collected for some ticks at once

}  // namespace

Stop sweepShape(const AvatarShape& shape, const Vec3& feet, const Vec3& displacement,
                std::vector<Obstacle>& obstacles, const collision::StoppingBand& band,
                QueryCount& count) {
  Stop stop;
  Vec3 rest = displacement;  // only what lies before the earliest stop so far matters
  for (std::size_t i = 0; i < shape.parts.size(); ++i) {
    const Box start = boxAt(shape.parts[i].box, feet);
    Box path = grown(collision::swept(start, rest), band.high);
    for (Obstacle& obstacle : obstacles) {
      if (!overlaps(path, obstacle.box)) continue;
      const collision::SweepResult result = collision::sweep(
          bodyAt(shape.parts[i], feet), rest, obstacle.body, band, obstacle.cacheOf(i));
      count.narrow += result.queries;
      count.rational += result.rationals;
      count.bounded += result.boundReached ? 1 : 0;
      const double fraction = stop.fraction * result.fraction;
      if (!result.stopped || (stop.entity != 0 && fraction >= stop.fraction)) continue;
      stop = {fraction, obstacle.entity, -result.atStop.normal, result.atStop.distance,
              result.atStop};
      if (fraction == 0) return stop;
      rest = fraction * displacement;
      path = grown(collision::swept(start, rest), band.high);
    }
  }
  return stop;
}

bool isFree(const AvatarShape& shape, const Vec3& feet, double clearance,
            std::vector<Obstacle>& obstacles, QueryCount& count, EntityId& nearest) {
  for (std::size_t i = 0; i < shape.parts.size(); ++i) {
    const Box box = grown(boxAt(shape.parts[i].box, feet), clearance);
    for (Obstacle& obstacle : obstacles) {
      if (!overlaps(box, obstacle.box)) continue;
      ++count.narrow;
      const auto decision = collision::decideWithin(bodyAt(shape.parts[i], feet), obstacle.body,
                                                    clearance, obstacle.cacheOf(i));
      if (!decision) continue;
      if (decision->decidedBy == collision::DecidedBy::rational) ++count.rational;
      nearest = obstacle.entity;
      return false;
    }
  }
  return true;
}

Box feetRoomIn(const Box& reach, const Box& shapeBox, double clearance) {
  return grown(Box{reach.min - shapeBox.min, reach.max - shapeBox.max}, -clearance);
}

double partInside(const Box& room, const Vec3& feet, const Vec3& displacement) {
  double part = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = displacement[axis];
    const double left = (way > 0 ? room.max[axis] : room.min[axis]) - feet[axis];
    if (way != 0) part = std::min(part, std::max(0.0, left / way));
  }
  return part;
}

void placeObstacle(const WorldState& world, Obstacle& obstacle) {
  if (obstacle.ofBody != kNoBody) {
    const Body& body = world.bodies[obstacle.ofBody];
    obstacle.box = body.partBoxes[obstacle.part];
    obstacle.body = partOf(body, obstacle.part);
    // Where it will stand: the solver moves it when avatars have moved.
    obstacle.box.min.y() += body.risesBy, obstacle.box.max.y() += body.risesBy;
    obstacle.body.translation.y() += body.risesBy;
  } else if (obstacle.entity >= world.firstAvatarId()) {
    const auto& name = world.avatarNames[obstacle.entity - world.firstAvatarId()];
    const Avatar& other = world.avatars.at(name);
    const AvatarPart& part = other.shape->parts[obstacle.part];
    obstacle.box = boxAt(part.box, other.feet);
    obstacle.body = bodyAt(part, other.feet);
  }
}

void gatherStill(const Scene& scene, std::uint32_t object, const Box& reach,
                 std::vector<Obstacle>& obstacles) {
  const ObjectParts& parts = scene.parts(object);
  thread_local std::vector<std::uint32_t> found;
  found.clear();
  parts.query(reach, found);
  for (const std::uint32_t part : found) {
    Obstacle obstacle;
    obstacle.entity = object + 1;
    obstacle.part = part;
    obstacle.box = parts.box(part);
    obstacle.body = parts.body(part);
    obstacles.push_back(obstacle);
  }
}

namespace {

/// All parts of a body; triggers are not solid.
void listParts(const WorldState& world, std::uint32_t index, std::vector<Obstacle>& obstacles) {
  const Body& body = world.bodies[index];
  if (body.spec->kind == BodyKind::trigger) return;
  for (std::uint32_t part = 0; part < body.partBoxes.size(); ++part) {
    Obstacle obstacle;
    obstacle.entity = body.id;
    obstacle.part = part;
    obstacle.ofBody = index;
    obstacles.push_back(obstacle);
  }
}

/// Ascending; the axes of last tick are handed on by merging.
void sortAndHandOn(std::vector<Obstacle>& obstacles, std::vector<Obstacle>& last) {
  // Movers' ids are reused and so not in the order of entities.
  const auto key = [](const Obstacle& o) { return std::pair(o.entity, o.part); };
  std::sort(obstacles.begin(), obstacles.end(),
            [&](const Obstacle& a, const Obstacle& b) { return key(a) < key(b); });
  auto old = last.begin();
  for (Obstacle& obstacle : obstacles) {
    while (old != last.end() && key(*old) < key(obstacle)) ++old;
    if (old != last.end() && key(*old) == key(obstacle)) {
      obstacle.cache = old->cache;
      obstacle.moreCaches = std::move(old->moreCaches);
    }
  }
}

/// Bodies that stand are as still objects.
bool mayMove(const WorldState& world, collision::MoverId mover) {
  const auto found = world.bodyOfMover.find(mover);
  if (found == world.bodyOfMover.end()) return true;
  const Body& body = world.bodies[found->second];
  return body.moved || (body.spec->kind == BodyKind::rigid && !body.asleep);
}

}  // namespace

bool nobodyMovesNear(const WorldState& world, const Avatar& avatar) {
  const auto partners = world.broadPhase.partners(avatar.mover);
  for (std::size_t i = partners.size(); i-- > 0 && partners[i].moves;)  // movers come last
    if (mayMove(world, partners[i].id)) return false;
  return true;
}

void gatherParts(const WorldState& world, std::uint32_t body, const Box& reach,
                 std::vector<Obstacle>& obstacles) {
  if (!overlaps(world.bodies[body].reach, reach)) return;
  std::vector<Obstacle> all;
  listParts(world, body, all);
  for (Obstacle& obstacle : all) {
    placeObstacle(world, obstacle);
    if (overlaps(obstacle.box, reach)) obstacles.push_back(obstacle);
  }
}

void followOthers(const WorldState& world, Avatar& avatar) {
  for (std::size_t i = avatar.obstacles.size(); i-- > 0;) {
    Obstacle& obstacle = avatar.obstacles[i];
    // Avatars come last, bodies anywhere.
    if (!avatar.meetsBodies && obstacle.entity < world.firstAvatarId()) return;
    placeObstacle(world, obstacle);
  }
}

void gatherObstacles(WorldState& world, Avatar& avatar) {
  const bool complete = !avatar.pairsChanged && contains(avatar.gathered, avatar.reach);
  avatar.pairsChanged = false;
  if (complete) return followOthers(world, avatar);
  std::vector<Obstacle> last;
  last.swap(avatar.obstacles);
  avatar.meetsBodies = false;
  avatar.gathered = grown(avatar.reach, kGatherMargin);
  for (const auto& partner : world.broadPhase.partners(avatar.mover)) {
    if (!partner.moves) {
      gatherStill(*world.scene, world.scene->solidObjects()[partner.id], avatar.gathered,
                  avatar.obstacles);
    } else if (const auto body = world.bodyOfMover.find(partner.id);
               body != world.bodyOfMover.end()) {
      listParts(world, body->second, avatar.obstacles);
      avatar.meetsBodies = true;
    } else {
      const Avatar& other = world.avatars.at(world.avatarOfMover.at(partner.id));
      for (std::uint32_t part = 0; part < other.shape->parts.size(); ++part) {
        avatar.obstacles.emplace_back();
        avatar.obstacles.back().entity = other.id;
        avatar.obstacles.back().part = part;
      }
    }
  }
  sortAndHandOn(avatar.obstacles, last);
  followOthers(world, avatar);
}

}  // namespace enfilade::scene
