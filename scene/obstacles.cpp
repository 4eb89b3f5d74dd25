#include "scene/obstacles.hpp"

#include <algorithm>

#include "scene/world_state.hpp"

namespace enfilade::scene {
namespace {

constexpr double kGatherMargin = 0.15;  // metres: obstacles are collected for some ticks at once

}  // namespace

Stop sweepHull(const collision::Hull& hull, const Box& hullBox, const Vec3& feet,
               const Vec3& displacement, std::vector<Obstacle>& obstacles,
               const collision::StoppingBand& band, QueryCount& count) {
  Stop stop;
  const Box start = boxAt(hullBox, feet);
  Vec3 rest = displacement;  // only what lies before the earliest stop so far matters
  Box path = grown(collision::swept(start, rest), band.high);
  for (Obstacle& obstacle : obstacles) {
    if (!overlaps(path, obstacle.box)) continue;
    const collision::SweepResult result =
        collision::sweep(bodyAt(hull, feet), rest, obstacle.body, band, obstacle.cache);
    count.narrow += result.queries;
    count.rational += result.rationals;
    count.bounded += result.boundReached ? 1 : 0;
    const double fraction = stop.fraction * result.fraction;
    if (!result.stopped || (stop.entity != 0 && fraction >= stop.fraction)) continue;
    stop = {fraction, obstacle.entity, -result.atStop.normal, result.atStop.distance};
    if (fraction == 0) break;
    rest = fraction * displacement;
    path = grown(collision::swept(start, rest), band.high);
  }
  return stop;
}

bool isFree(const collision::Hull& hull, const Box& hullBox, const Vec3& feet, double clearance,
            std::vector<Obstacle>& obstacles, QueryCount& count, EntityId& nearest) {
  const Box box = grown(boxAt(hullBox, feet), clearance);
  for (Obstacle& obstacle : obstacles) {
    if (!overlaps(box, obstacle.box)) continue;
    ++count.narrow;
    const auto decision =
        collision::decideWithin(bodyAt(hull, feet), obstacle.body, clearance, obstacle.cache);
    if (!decision) continue;
    if (decision->decidedBy == collision::DecidedBy::rational) ++count.rational;
    nearest = obstacle.entity;
    return false;
  }
  return true;
}

void gatherTriangles(const Scene& scene, std::uint32_t object, const Box& reach,
                     std::vector<Obstacle>& obstacles) {
  const collision::TriangleTree& tree = scene.triangles(object);
  thread_local std::vector<std::uint32_t> found;
  found.clear();
  tree.query(reach, found);
  for (const std::uint32_t i : found) {
    const collision::Triangle& t = tree.triangles()[i];
    Obstacle obstacle;
    obstacle.entity = object + 1;
    obstacle.part = i;
    obstacle.box = {t[0].cwiseMin(t[1]).cwiseMin(t[2]), t[0].cwiseMax(t[1]).cwiseMax(t[2])};
    obstacle.body = {std::span<const Vec3>(t), Vec3::Zero()};
    obstacles.push_back(obstacle);
  }
}

void followOthers(const WorldState& world, Avatar& avatar) {
  for (std::size_t i = avatar.obstacles.size(); i-- > 0;) {
    Obstacle& obstacle = avatar.obstacles[i];
    if (obstacle.entity < world.firstAvatarId()) return;  // avatars come last
    const auto& name = world.avatarNames[obstacle.entity - world.firstAvatarId()];
    const Avatar& other = world.avatars.at(name);
    obstacle.box = boxAt(other.hullBox, other.feet);
    obstacle.body = bodyAt(*other.hull, other.feet);
  }
}

void gatherObstacles(WorldState& world, Avatar& avatar, bool pairsChanged) {
  if (!pairsChanged && contains(avatar.gathered, avatar.reach)) return followOthers(world, avatar);
  std::vector<Obstacle> last;
  last.swap(avatar.obstacles);
  avatar.gathered = grown(avatar.reach, kGatherMargin);
  for (const auto& partner : world.broadPhase.partners(avatar.mover)) {
    if (!partner.moves) {
      gatherTriangles(*world.scene, world.scene->solidObjects()[partner.id], avatar.gathered,
                      avatar.obstacles);
      continue;
    }
    Obstacle other;
    other.entity = world.avatars.at(world.avatarOfMover.at(partner.id)).id;
    avatar.obstacles.push_back(other);
  }
  // Movers' ids are reused and so not in the order of entities.
  const auto key = [](const Obstacle& o) { return std::pair(o.entity, o.part); };
  std::sort(avatar.obstacles.begin(), avatar.obstacles.end(),
            [&](const Obstacle& a, const Obstacle& b) { return key(a) < key(b); });
  followOthers(world, avatar);
  // Hand the axes of last tick on by merging.
  auto old = last.begin();
  for (Obstacle& obstacle : avatar.obstacles) {
    while (old != last.end() && key(*old) < key(obstacle)) ++old;
    if (old != last.end() && key(*old) == key(obstacle)) obstacle.cache = old->cache;
  }
}

}  // namespace enfilade::scene
