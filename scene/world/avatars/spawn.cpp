// Where an avatar may come into the world: clear of everything by epsilon, not inside a closed
// solid, and above some floor. People write the floor's own height, so the feet are lifted a little
// when they would touch.
#include <algorithm>
#include <array>

#include "scene/model/rotation.hpp"
#include "scene/world/avatars/order_context.hpp"
#include "scene/world/queries/point_in_solid.hpp"

namespace enfilade::scene {
namespace {

constexpr std::array<double, 4> kLifts{0, 0.002, 0.02, 0.1};  // metres
constexpr double kFloorMargin = 1.0;  // metres below the scene's lowest point that are searched
constexpr double kDeepestDrop = 100;  // metres: who is put higher is a slip of the pen
constexpr double kDropTold = 2;       // metres: a drop that is worth telling
// Triangles and narrow-phase queries that the search for room near a refused place may cost: some
// milliseconds, since it is made inside a tick.
constexpr std::uint64_t kMostSearched = 300'000;

/// A search for a place, and what it costs.
struct Search {
  const WorldState& world;
  QueryCount& count;
  std::uint64_t triangles = 0;  ///< looked at
  std::uint64_t cost() const { return triangles + count.narrow; }
};

/// The object whose solid holds `point`, or 0.
EntityId solidAround(Search& search, const Vec3& point) {
  const WorldState& world = search.world;
  for (const collision::StillId still : world.broadPhase.stillOverlapping({point, point})) {
    const std::uint32_t object = world.scene->solidObjects()[still];
    const ObjectParts& parts = world.scene->parts(object);
    search.triangles += parts.localTriangles.triangles().size();
    if (holds(parts, point)) return object + 1;
  }
  return 0;
}

/// What is below, and how deep; entity 0: nothing.
struct Floor {
  EntityId entity = 0;
  double depth = 0;  ///< metres
};

Floor floorBelow(Search& search, const Avatar& avatar) {
  const WorldState& world = search.world;
  const double depth = avatar.feet.y() - world.scene->bounds().min.y() + kFloorMargin;
  if (!(depth > 0)) return {};
  const Vec3 down{0, -depth, 0};
  const Box column = collision::swept(boxAt(avatar.shape->box, avatar.feet), down);
  std::vector<Obstacle> obstacles = obstaclesIn(world, column, 0);
  const double epsilon = world.lengths.epsilon;
  const Stop stop = sweepShape(*avatar.shape, avatar.feet, down, obstacles,
                               {0.5 * epsilon, epsilon}, search.count);
  return {stop.entity, stop.fraction * depth};
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

/// Why the avatar cannot be where its feet are, lifts not tried; nullopt when it can.
std::optional<std::string> whyNotThere(Search& search, const Avatar& avatar,
                                       std::vector<Obstacle>& obstacles) {
  const WorldState& world = search.world;
  for (const AvatarPart& part : avatar.shape->parts)
    if (const EntityId solid = solidAround(search, avatar.feet + part.box.centre()))
      return "it would stand inside " + pathOf(world, solid);
  EntityId inTheWay = 0;
  if (!isFree(*avatar.shape, avatar.feet, world.lengths.epsilon, obstacles, search.count, inTheWay))
    return "it would stand in " + pathOf(world, inTheWay);
  if (avatar.flying) return std::nullopt;
  const Floor floor = floorBelow(search, avatar);
  if (floor.entity == 0)
    return "there is no floor below; the scene spans " + text(world.scene->bounds().min) + " to " +
           text(world.scene->bounds().max);
  if (floor.depth > kDeepestDrop)
    return "the floor, " + pathOf(world, floor.entity) + ", is " + shortNumber(floor.depth) +
           " m below, and nobody drops farther than " + shortNumber(kDeepestDrop) + " m";
  return std::nullopt;
}

/// As whyNotThere(), the feet lifted a little if that helps.
std::optional<std::string> tryPlace(Search& search, const Vec3& at, Avatar& avatar) {
  const WorldState& world = search.world;
  Box around = boxAt(avatar.shape->box, at);
  around.max.y() += kLifts.back();
  std::vector<Obstacle> obstacles = obstaclesIn(world, grown(around, 2 * world.lengths.epsilon), 0);
  std::optional<std::string> why;
  for (const double lift : kLifts) {
    avatar.feet = at + Vec3(0, lift, 0);
    why = whyNotThere(search, avatar, obstacles);
    if (!why) break;
  }
  return why;
}

/// Where near `at` there is room, for the text of a refusal: rings over the ground, from the
/// nearest on, then some heights.
std::string nearestRoom(Search& search, const Vec3& at, Avatar& avatar) {
  constexpr std::array<double, 5> kRings{0.2, 0.5, 1, 2, 4};  // metres
  constexpr std::array<double, 2> kHeights{0, 1};             // metres
  constexpr int kDirections = 8;
  const std::uint64_t enough = search.cost() + kMostSearched;
  for (const double height : kHeights) {
    for (const double ring : kRings) {
      if (search.cost() > enough) return "; room near it was not searched for any longer";
      for (int i = 0; i < kDirections; ++i) {
        const Vec3 place =
            at + ring * headingFromDegrees(360.0 / kDirections * i) + Vec3(0, height, 0);
        if (tryPlace(search, place, avatar)) continue;
        return "; there is room at " + text(avatar.feet) + ", " +
               shortNumber((avatar.feet - at).norm()) + " m away";
      }
    }
  }
  return "; there is no room within " + shortNumber(kRings.back()) + " m";
}

Mat3 turnedTo(const Vec3& heading) {
  Mat3 turn;
  turn.col(0) = heading;
  turn.col(1) = Vec3::UnitY();
  turn.col(2) = heading.cross(Vec3::UnitY());
  return turn;
}

}  // namespace

std::vector<Obstacle> obstaclesIn(const WorldState& world, const Box& box, EntityId except) {
  std::vector<Obstacle> obstacles;
  for (const collision::StillId still : world.broadPhase.stillOverlapping(box))
    gatherStill(*world.scene, world.scene->solidObjects()[still], box, obstacles);
  for (std::uint32_t i = 0; i < world.bodies.size(); ++i) gatherParts(world, i, box, obstacles);
  for (const auto& [name, other] : world.avatars) {
    if (other.id == except) continue;
    for (std::uint32_t part = 0; part < other.shape->parts.size(); ++part) {
      Obstacle obstacle;
      obstacle.entity = other.id;
      obstacle.part = part;
      obstacle.box = boxAt(other.shape->parts[part].box, other.feet);
      obstacle.body = bodyAt(other.shape->parts[part], other.feet);
      if (overlaps(obstacle.box, box)) obstacles.push_back(obstacle);
    }
  }
  return obstacles;
}

void shapeAvatar(const Spawn& order, const Lengths& lengths, Avatar& avatar) {
  const Mat3 turn = turnedTo(headingFromDegrees(order.facing));
  avatar.radius = order.radius;
  avatar.flying = order.flying;
  avatar.height = avatar.standing = order.parts.empty() ? order.height : 0;
  avatar.shape = prismShape(order.radius, order.height, order.height, lengths);
  if (!order.parts.empty()) {
    std::vector<AvatarPart> parts;
    for (const std::vector<Vec3>& points : order.parts) {
      auto hull = std::make_shared<const collision::Hull>(collision::buildHull(points));
      parts.push_back(placedPart(std::move(hull), Vec3::Zero(), turn));
    }
    avatar.shape = shapeOf(std::move(parts));
  }
  if (!order.parts.empty() || !order.links.empty())
    avatar.madeOf = std::make_shared<const Spawn>(order);
  avatar.eyeHeight = eyeHeightOf(avatar.shape->box.max.y());
  if (order.links.empty()) return;
  avatar.base = avatar.shape->parts;
  avatar.chain = chainOf(order, turn);
  avatar.shape = shapeWith(avatar.base, avatar.chain);
}

std::optional<std::string> placeAvatar(const WorldState& world, const Spawn& order, Avatar& avatar,
                                       std::string& told, QueryCount& count) {
  shapeAvatar(order, world.lengths, avatar);
  Search search{world, count, 0};
  if (const auto why = tryPlace(search, order.at, avatar)) {
    const std::string room = nearestRoom(search, order.at, avatar);
    return "at " + text(order.at) + " " + *why + room;
  }
  if (avatar.flying) return std::nullopt;
  const Floor floor = floorBelow(search, avatar);
  if (floor.depth > kDropTold)
    told = "drops " + shortNumber(floor.depth) + " m to " + pathOf(world, floor.entity);
  return std::nullopt;
}

}  // namespace enfilade::scene
