// Where an avatar may come into the world: clear of everything by epsilon, not inside a closed
// solid, and above some floor. People write the floor's own height, so the feet are lifted a little
// when they would touch.
#include <algorithm>
#include <array>

#include "scene/world_state.hpp"

namespace enfilade::scene {
namespace {

constexpr std::array<double, 4> kLifts{0, 0.002, 0.02, 0.1};  // metres
constexpr double kFloorMargin = 1.0;  // metres below the scene's lowest point that are searched

void gatherAll(const WorldState& world, const Box& box, std::vector<Obstacle>& obstacles) {
  for (const collision::StillId still : world.broadPhase.stillOverlapping(box))
    gatherStill(*world.scene, world.scene->solidObjects()[still], box, obstacles);
  for (std::uint32_t i = 0; i < world.bodies.size(); ++i) gatherParts(world, i, box, obstacles);
  for (const auto& [name, other] : world.avatars) {
    for (std::uint32_t part = 0; part < other.shape->parts.size(); ++part) {
      Obstacle obstacle;
      obstacle.entity = other.id;
      obstacle.part = part;
      obstacle.box = boxAt(other.shape->parts[part].box, other.feet);
      obstacle.body = bodyAt(other.shape->parts[part], other.feet);
      if (overlaps(obstacle.box, box)) obstacles.push_back(obstacle);
    }
  }
}

bool isInsideHull(const ObjectParts& parts, const Vec3& point) {
  const std::array<Vec3, 1> vertex{point};
  for (std::size_t i = 0; i < parts.hulls.size(); ++i) {
    if (!overlaps(parts.hullBoxes[i], {point, point})) continue;
    const collision::Hull& hull = parts.hulls[i];
    collision::FeatureCache cache;
    const auto decision = collision::decide({vertex, Vec3::Zero(), nullptr, nullptr},
                                            {hull.vertices, Vec3::Zero(), nullptr, &hull}, cache);
    if (decision.verdict != collision::Verdict::separated) return true;
  }
  return false;
}

/// The object whose solid holds `point`, or 0.
EntityId solidAround(const WorldState& world, const Vec3& point) {
  for (const collision::StillId still : world.broadPhase.stillOverlapping({point, point})) {
    const std::uint32_t object = world.scene->solidObjects()[still];
    const ObjectParts& parts = world.scene->parts(object);
    if (isInsideHull(parts, point) || surrounds(parts, point)) return object + 1;
  }
  return 0;
}

bool hasFloorBelow(const WorldState& world, const Avatar& avatar, QueryCount& count) {
  const double depth = avatar.feet.y() - world.scene->bounds().min.y() + kFloorMargin;
  if (!(depth > 0)) return false;
  const Vec3 down{0, -depth, 0};
  const Box column = collision::swept(boxAt(avatar.shape->box, avatar.feet), down);
  std::vector<Obstacle> obstacles;
  gatherAll(world, column, obstacles);
  const double epsilon = world.lengths.epsilon;
  return sweepShape(*avatar.shape, avatar.feet, down, obstacles, {0.5 * epsilon, epsilon}, count)
             .entity != 0;
}

std::string pathOf(const WorldState& world, EntityId id) {
  const EntityId first = world.firstAvatarId();
  if (const auto body = world.bodyOfId.find(id); body != world.bodyOfId.end())
    return world.bodies[body->second].spec->name;
  return id >= first ? world.avatarNames[id - first] : world.scene->model().objects[id - 1].path;
}

std::string text(const Vec3& v) {
  return "[" + std::to_string(v.x()) + ", " + std::to_string(v.y()) + ", " + std::to_string(v.z()) +
         "]";
}

}  // namespace

std::optional<std::string> placeAvatar(const WorldState& world, const Spawn& order, Avatar& avatar,
                                       QueryCount& count) {
  avatar.shape = prismShape(order.radius, order.height, order.height);
  const double epsilon = world.lengths.epsilon;
  Box around = boxAt(avatar.shape->box, order.at);
  around.max.y() += kLifts.back();
  std::vector<Obstacle> obstacles;
  gatherAll(world, grown(around, 2 * epsilon), obstacles);

  EntityId inTheWay = 0;
  for (const double lift : kLifts) {
    avatar.feet = order.at + Vec3(0, lift, 0);
    if (!isFree(*avatar.shape, avatar.feet, epsilon, obstacles, count, inTheWay)) continue;
    const Vec3 middle = avatar.feet + avatar.shape->box.centre();
    if (const EntityId solid = solidAround(world, middle))
      return "at " + text(order.at) + " it would stand inside " + pathOf(world, solid);
    if (!hasFloorBelow(world, avatar, count))
      return "there is no floor below " + text(order.at) + "; the scene spans " +
             text(world.scene->bounds().min) + " to " + text(world.scene->bounds().max);
    return std::nullopt;
  }
  if (const EntityId solid = solidAround(world, order.at + avatar.shape->box.centre()))
    return "at " + text(order.at) + " it would stand inside " + pathOf(world, solid);
  return "at " + text(order.at) + " it would stand in " + pathOf(world, inTheWay) +
         "; move it at least " + std::to_string(epsilon) + " m clear";
}

}  // namespace enfilade::scene
