// Placement of new avatars. A valid position is a contact offset away from all obstacles, outside
// closed solids, and above a floor. Users often give the floor's own height, so the feet are lifted
// slightly if they would touch.
#include "scene/world/avatars/spawn.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "scene/model/rotation.hpp"
#include "scene/world/avatars/order_context.hpp"
#include "scene/world/contacts/obstacles.hpp"
#include "scene/world/queries/point_in_solid.hpp"

namespace enfilade::scene {
namespace {

constexpr std::array<double, 4> kTrialLifts{0, 0.002, 0.02, 0.1};  // metres
constexpr double kFloorMargin = 1.0;    // metres searched below the scene's lowest point
constexpr double kMaxDrop = 100;        // metres: a higher position is probably a mistake
constexpr double kMinReportedDrop = 2;  // metres: minimum drop that is reported
// Maximum number of triangles and narrow-phase queries in the search for a free position near a
// refused one. They take a few milliseconds, because the search runs inside a tick.
constexpr std::uint64_t kMaxSearchCost = 300'000;

/// A search for a free position, and its cost.
struct PlacementSearch {
  const WorldData& world;
  QueryCount& count;
  std::uint64_t triangles = 0;  ///< tested
  std::uint64_t cost() const { return triangles + count.narrow; }
};

/// The static object whose closed solid contains `point`; 0: none.
EntityId findEnclosingSolid(PlacementSearch& search, const Vec3& point) {
  const WorldData& world = search.world;
  for (const collision::StaticId staticId : world.broadPhase.overlapStatic({point, point})) {
    const std::uint32_t object = world.scene->solidObjects()[staticId];
    const CollisionGeometry& parts = world.scene->collisionGeometry(object);
    search.triangles += parts.localTriangles.triangles().size();
    if (containsPoint(parts, point)) return object + 1;
  }
  return 0;
}

/// The floor below an avatar, and its distance; entity 0: none.
struct FloorHit {
  EntityId entity = 0;
  double depth = 0;  ///< metres
};

FloorHit findFloorBelow(PlacementSearch& search, const Avatar& avatar) {
  const WorldData& world = search.world;
  const double depth = avatar.footPosition.y() - world.scene->bounds().min.y() + kFloorMargin;
  if (!(depth > 0)) return {};
  const Vec3 down{0, -depth, 0};
  const Aabb column =
      collision::computeSweptAabb(placeBox(avatar.shape->box, avatar.footPosition), down);
  ObstacleSet obstacles = collectObstaclesInBox(world, column, avatar.id);
  const double contactOffset = world.settings.contactOffset;
  const ShapeCastHit hit = castAvatarShape(*avatar.shape, avatar.footPosition, down, obstacles,
                                           {0.5 * contactOffset, contactOffset}, search.count);
  return {hit.entity, hit.fraction * depth};
}

/// Error of the avatar's current position, without lifts; nullopt if it is valid.
std::optional<std::string> validatePlacement(PlacementSearch& search, const Avatar& avatar,
                                             ObstacleSet& obstacles) {
  const WorldData& world = search.world;
  for (const AvatarPart& part : avatar.shape->parts)
    if (const EntityId solid = findEnclosingSolid(search, avatar.footPosition + part.box.centre()))
      return "it would be inside the solid " + world.findEntityName(solid);
  EntityId blocker = 0;
  if (!isClear(*avatar.shape, avatar.footPosition, world.settings.contactOffset, obstacles,
               search.count, blocker))
    return "it would overlap " + world.findEntityName(blocker);
  if (avatar.flying) return std::nullopt;
  const FloorHit floor = findFloorBelow(search, avatar);
  if (floor.entity == 0)
    return "there is no floor below; the scene spans " + formatPoint(world.scene->bounds().min) +
           " to " + formatPoint(world.scene->bounds().max);
  if (floor.depth > kMaxDrop)
    return "the floor, " + world.findEntityName(floor.entity) + ", is " +
           formatShortNumber(floor.depth) + " m below; the maximum drop is " +
           formatShortNumber(kMaxDrop) + " m";
  return std::nullopt;
}

/// As validatePlacement(), but tries to lift the feet slightly. Sets the avatar's foot position.
std::optional<std::string> tryPlacement(PlacementSearch& search, const Vec3& at, Avatar& avatar) {
  const WorldData& world = search.world;
  Aabb searchBox = placeBox(avatar.shape->box, at);
  searchBox.max.y() += kTrialLifts.back();
  ObstacleSet obstacles =
      collectObstaclesInBox(world, inflate(searchBox, 2 * world.settings.contactOffset), avatar.id);
  std::optional<std::string> error;
  for (const double lift : kTrialLifts) {
    avatar.footPosition = at + Vec3(0, lift, 0);
    error = validatePlacement(search, avatar, obstacles);
    if (!error) break;
  }
  return error;
}

constexpr std::array<double, 5> kRings{0.2, 0.5, 1, 2, 4};  // metres around a refused position

/// The free position nearest to `at` on horizontal rings of increasing radius, at each height.
std::optional<Vec3> findPlaceAround(PlacementSearch& search, const Vec3& at, Avatar& avatar,
                                    std::uint64_t maxCost) {
  constexpr std::array<double, 2> kHeights{0, 1};  // metres
  constexpr int kDirections = 8;
  for (const double height : kHeights) {
    for (const double ring : kRings) {
      if (search.cost() > maxCost) return std::nullopt;
      for (int i = 0; i < kDirections; ++i) {
        const Vec3 position =
            at + ring * makeHeadingFromDegrees(360.0 / kDirections * i) + Vec3(0, height, 0);
        if (!tryPlacement(search, position, avatar)) return avatar.footPosition;
      }
    }
  }
  return std::nullopt;
}

/// The floor below `at`, if an avatar that starts lower fits. A start with the head in the ceiling
/// is a wrong height more often than a wrong place.
std::optional<Vec3> findFloorUnder(PlacementSearch& search, const Vec3& at, Avatar& avatar,
                                   std::uint64_t maxCost) {
  constexpr double kStep = 0.25, kMaxDepth = 3;  // metres: less than a storey and its slab
  for (double depth = kStep; depth <= kMaxDepth && search.cost() <= maxCost; depth += kStep) {
    if (tryPlacement(search, at - Vec3(0, depth, 0), avatar)) continue;
    if (avatar.flying) return avatar.footPosition;
    return avatar.footPosition - Vec3(0, findFloorBelow(search, avatar).depth, 0);
  }
  return std::nullopt;
}

/// Describes the nearest free position around or below `at`, for an error message.
std::string describeFreePlace(PlacementSearch& search, const Vec3& at, Avatar& avatar) {
  const std::uint64_t maxCost = search.cost() + kMaxSearchCost;
  const std::optional<Vec3> below = findFloorUnder(search, at, avatar, maxCost);
  std::optional<Vec3> place = findPlaceAround(search, at, avatar, maxCost);
  if (below && (!place || (*below - at).norm() < (*place - at).norm())) place = below;
  if (place)
    return "; there is room at " + formatPoint(*place) + ", " +
           formatShortNumber((*place - at).norm()) + " m away";
  if (search.cost() > maxCost) return "; the search for a free position reached its limit";
  return "; there is no room within " + formatShortNumber(kRings.back()) + " m";
}

Mat3 makeHeadingRotation(const Vec3& heading) {
  Mat3 rotation;
  rotation.col(0) = heading;
  rotation.col(1) = Vec3::UnitY();
  rotation.col(2) = heading.cross(Vec3::UnitY());
  return rotation;
}

/// Its box is always tight: an avatar rarely turns, and a larger box costs pairs at rest too.
TurningHull makeTurningPart(const std::vector<Vec3>& points) {
  collision::Hull hull = collision::buildHull(points);
  const collision::AabbMethod method = collision::chooseTightMethod(hull);
  return makeTurningHull(std::move(hull), method);
}

/// Parts at the rotation of a facing.
std::vector<AvatarPart> placeTurningParts(Avatar& avatar, const Mat3& rotation) {
  std::vector<AvatarPart> parts;
  for (TurningHull& turning : avatar.turningParts)
    parts.push_back(placeTurningHull(turning, Vec3::Zero(), rotation, avatar.boxWork));
  return parts;
}

/// Height of the highest vertex above the feet. The box may be higher by its rounding.
double computeTop(const AvatarShape& shape) {
  double top = -std::numeric_limits<double>::infinity();
  for (const AvatarPart& part : shape.parts)
    for (const Vec3& v : part.hull->vertices) top = std::max(top, v.y());
  return top;
}

}  // namespace

void applySpawnShape(const Spawn& order, const WorldSettings& settings, Avatar& avatar) {
  const Mat3 rotation = makeHeadingRotation(makeHeadingFromDegrees(order.facing));
  avatar.radius = order.radius;
  avatar.flying = order.flying;
  avatar.height = avatar.spawnHeight = order.parts.empty() ? order.height : 0;
  avatar.shape = makePrismShape(order.radius, order.height, order.height, settings);
  if (!order.parts.empty()) {
    for (const std::vector<Vec3>& points : order.parts)
      avatar.turningParts.push_back(makeTurningPart(points));
    avatar.shape = makeAvatarShape(placeTurningParts(avatar, rotation));
  }
  if (!order.parts.empty() || !order.links.empty()) {
    avatar.spawnOrder = std::make_shared<const Spawn>(order);
    avatar.facing = order.facing;
  }
  avatar.eyeHeight = computeEyeHeight(computeTop(*avatar.shape));
  if (order.links.empty()) return;
  avatar.baseParts = avatar.shape->parts;
  avatar.chain = makeChain(order, rotation);
  avatar.shape = makeChainShape(avatar.baseParts, avatar.chain, avatar.boxWork);
}

void setFacing(Avatar& avatar, double degrees) {
  if (!turnsShape(avatar)) return;
  avatar.facing = degrees;
  const Mat3 rotation = makeHeadingRotation(makeHeadingFromDegrees(degrees));
  std::vector<AvatarPart> parts = placeTurningParts(avatar, rotation);
  if (avatar.chain.links.empty()) {
    avatar.shape = makeAvatarShape(std::move(parts));
    return;
  }
  if (!parts.empty()) avatar.baseParts = std::move(parts);
  avatar.chain.avatarFromBase = rotation;
  avatar.shape = makeChainShape(avatar.baseParts, avatar.chain, avatar.boxWork);
}

std::optional<std::string> placeStanding(const WorldData& world, const Vec3& position,
                                         Avatar& avatar, QueryCount& count) {
  PlacementSearch search{world, count, 0};
  return tryPlacement(search, position, avatar);
}

std::optional<std::string> placeOrSuggest(const WorldData& world, const Vec3& position,
                                          Avatar& avatar, std::string& message, QueryCount& count) {
  PlacementSearch search{world, count, 0};
  if (const auto error = tryPlacement(search, position, avatar)) {
    const std::string suggestion = describeFreePlace(search, position, avatar);
    return "at " + formatPoint(position) + " " + *error + suggestion;
  }
  if (avatar.flying) return std::nullopt;
  const FloorHit floor = findFloorBelow(search, avatar);
  if (floor.depth > kMinReportedDrop)
    message =
        "drops " + formatShortNumber(floor.depth) + " m to " + world.findEntityName(floor.entity);
  return std::nullopt;
}

}  // namespace enfilade::scene
