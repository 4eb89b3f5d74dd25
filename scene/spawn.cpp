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
    gatherTriangles(*world.scene, world.scene->solidObjects()[still], box, obstacles);
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

using Edge = std::array<double, 6>;

Edge edgeOf(const Vec3& from, const Vec3& to) {
  return {from.x(), from.y(), from.z(), to.x(), to.y(), to.z()};
}

/// Closed and consistently wound: every directed edge has its opposite, as often.
bool isClosed(const std::vector<collision::Triangle>& triangles) {
  std::vector<Edge> forth, back;
  for (const collision::Triangle& t : triangles) {
    for (int i = 0; i < 3; ++i) {
      forth.push_back(edgeOf(t[i], t[(i + 1) % 3]));
      back.push_back(edgeOf(t[(i + 1) % 3], t[i]));
    }
  }
  std::sort(forth.begin(), forth.end());
  std::sort(back.begin(), back.end());
  return forth == back;
}

/// How often the surface goes around `point`, by the signed crossings of a ray: 1 inside a solid
/// whose faces look outwards. An edge seen from both its triangles gives exactly opposite areas, so
/// that a ray slips between two triangles only if it meets their edge to the last bit.
int windingNumber(const std::vector<collision::Triangle>& triangles, const Vec3& point) {
  const Vec3 ray{0.8017, 0.5345, 0.2673};  // no axis of any building
  int winding = 0;
  for (const collision::Triangle& t : triangles) {
    const std::array<Vec3, 3> p{t[0] - point, t[1] - point, t[2] - point};
    std::array<double, 3> area;
    for (int i = 0; i < 3; ++i) area[i] = ray.dot(p[i].cross(p[(i + 1) % 3]));
    const bool leaves = area[0] > 0 && area[1] > 0 && area[2] > 0;
    const bool enters = area[0] < 0 && area[1] < 0 && area[2] < 0;
    if (!leaves && !enters) continue;
    const Vec3 normal = (p[1] - p[0]).cross(p[2] - p[0]);
    const bool ahead = (normal.dot(p[0]) > 0) == (normal.dot(ray) > 0);
    if (ahead) winding += leaves ? 1 : -1;
  }
  return winding;
}

/// The solid object that holds `point`, or 0. Open shells and inside-out ones hold nothing.
EntityId solidAround(const WorldState& world, const Vec3& point) {
  for (const collision::StillId still : world.broadPhase.stillOverlapping({point, point})) {
    const std::uint32_t object = world.scene->solidObjects()[still];
    const auto& triangles = world.scene->triangles(object).triangles();
    if (!isClosed(triangles)) continue;
    const bool mirrored =
        world.scene->model().objects[object].worldFromMesh.linear().determinant() < 0;
    const int winding = windingNumber(triangles, point);
    if ((mirrored ? -winding : winding) > 0) return object + 1;
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
  return "at " + text(order.at) + " it would stand in " + pathOf(world, inTheWay) +
         "; move it at least " + std::to_string(epsilon) + " m clear";
}

}  // namespace enfilade::scene
