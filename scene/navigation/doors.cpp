#include "scene/navigation/doors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "scene/navigation/ghost.hpp"
#include "scene/world/world.hpp"

namespace enfilade::scene {
namespace {

/// What an agent sweeps over on a leg: the hull of its prism at both ends, seen from the first.
std::shared_ptr<const AvatarShape> makeSweptShape(const AvatarShape& prism, const Vec3& leg) {
  std::vector<Vec3> points;
  for (const AvatarPart& part : prism.parts)
    for (const Vec3& vertex : part.hull->vertices) {
      points.push_back(vertex);
      points.push_back(vertex + leg);
    }
  auto hull = std::make_shared<const collision::Hull>(collision::buildHull(points));
  return makeAvatarShape({makeAvatarPart(std::move(hull), Vec3::Zero(), Mat3::Identity())});
}

double computeSecondsToOpen(const BodySpec& door, double position) {
  const double open =
      door.high - door.closedPosition >= door.closedPosition - door.low ? door.high : door.low;
  const double rest = std::abs(open - position);
  // Accelerated and decelerated motion takes no longer than that of both phases one after another.
  return rest / door.speed + (door.acceleration > 0 ? door.speed / door.acceleration : 0);
}

}  // namespace

bool hasDoors(const Scene& scene) {
  return std::ranges::any_of(scene.model().bodies,
                             [](const BodySpec& body) { return getTraits(body.kind).isDoor; });
}

std::shared_ptr<const Snapshot> makeSnapshotWithOpenDoors(std::shared_ptr<const Scene> scene,
                                                          const WorldSettings& settings) {
  constexpr double kMaxSeconds = 30;  // a door that takes longer stays where it is
  World world(std::move(scene), settings);
  for (const BodySpec& body : world.scene().model().bodies) {
    if (!getTraits(body.kind).isDoor) continue;
    BodyCommand command;
    command.body = body.name;
    command.action = BodyCommand::Action::open;
    submitBodyCommand(world, std::move(command));
  }
  const int maxTicks =
      hasDoors(world.scene()) ? static_cast<int>(kMaxSeconds / settings.tickDuration) : 0;
  for (int tick = 0; tick < maxTicks; ++tick) {
    tickWorld(world);
    const auto& bodies = *world.snapshot()->bodies;
    if (std::ranges::none_of(bodies, [&](const BodySnapshot& body) {
          return body.moving && getTraits(world.scene().model().bodies[body.index].kind).isDoor;
        }))
      break;
  }
  return world.snapshot();
}

std::vector<DoorOnPath> findDoorsOnPath(EntityIndex& index, const WorldSettings& settings,
                                        const Snapshot& snapshot, const NavigationAgent& agent,
                                        const std::vector<Vec3>& points) {
  std::vector<DoorOnPath> doors;
  const std::vector<BodySpec>& bodies = index.scene().model().bodies;
  if (!hasDoors(index.scene()) || points.size() < 2) return doors;
  const auto prism = makePrismShape(agent.radius, agent.height, agent.height, settings);
  double distance = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec3 leg = points[i] - points[i - 1];
    Aabb box = placeBox(prism->box, points[i - 1]);
    box.include(placeBox(prism->box, points[i]));
    box = inflated(box, settings.contactOffset);
    std::shared_ptr<const AvatarShape> swept;  // built for the first door that is near
    for (const BodySnapshot& body : *snapshot.bodies) {
      const BodySpec& spec = bodies[body.index];
      if (!getTraits(spec.kind).isDoor ||
          std::ranges::any_of(doors, [&](const DoorOnPath& d) { return d.body == body.index; }))
        continue;
      if (!overlaps(box, computeBodyAabb({index, snapshot}, body))) continue;
      if (!swept) swept = makeSweptShape(*prism, leg);
      const auto separation =
          computeSeparationFromShape(index, snapshot, swept, points[i - 1], body.id);
      if (separation && separation->distance < computeContactThreshold(settings))
        doors.push_back({body.index, distance, computeSecondsToOpen(spec, body.jointPosition)});
    }
    distance += leg.norm();
  }
  return doors;
}

}  // namespace enfilade::scene
