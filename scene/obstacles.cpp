#include "scene/obstacles.hpp"

namespace enfilade::scene {

Stop sweepHull(std::span<const Vec3> hull, const Box& hullBox, const Vec3& feet,
               const Vec3& displacement, std::vector<Obstacle>& obstacles,
               const collision::StoppingBand& band, QueryCount& count) {
  Stop stop;
  const Box start = boxAt(hullBox, feet);
  Vec3 rest = displacement;  // only what lies before the earliest stop so far matters
  Box path = grown(collision::swept(start, rest), band.high);
  for (Obstacle& obstacle : obstacles) {
    if (!overlaps(path, obstacle.box)) continue;
    const collision::SweepResult result =
        collision::sweep({hull, feet}, rest, obstacle.body, band, obstacle.cache);
    count.narrow += result.queries;
    count.rational += result.rationals;
    const double fraction = stop.fraction * result.fraction;
    if (!result.stopped || (stop.entity != 0 && fraction >= stop.fraction)) continue;
    stop = {fraction, obstacle.entity, -result.atStop.normal, result.atStop.distance};
    if (fraction == 0) break;
    rest = fraction * displacement;
    path = grown(collision::swept(start, rest), band.high);
  }
  return stop;
}

bool isFree(std::span<const Vec3> hull, const Box& hullBox, const Vec3& feet, double clearance,
            std::vector<Obstacle>& obstacles, QueryCount& count, EntityId& nearest) {
  const Box box = grown(boxAt(hullBox, feet), clearance);
  for (Obstacle& obstacle : obstacles) {
    if (!overlaps(box, obstacle.box)) continue;
    ++count.narrow;
    const auto decision =
        collision::decideWithin({hull, feet}, obstacle.body, clearance, obstacle.cache);
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

}  // namespace enfilade::scene
