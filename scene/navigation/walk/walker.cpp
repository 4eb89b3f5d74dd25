#include "scene/navigation/walk/walker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/world/avatars/avatar_motion.hpp"
#include "scene/world/avatars/spawn.hpp"
#include "scene/world/avatars/walk_velocity.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

constexpr double kCellSize = 2;      // metres: obstacles are collected for a cell at once
constexpr double kCellMargin = 0.2;  // metres
constexpr std::size_t kMaxNeighbourhoods = 512;  // remembered; above, all are forgotten
/// Lengths of a step on even floor, metres. A longer step than a tick's sweeps over the same space;
/// where it meets anything it is walked again at the speed of the walk.
constexpr double kLongStep = 0.1, kMaxStep = 1;
/// metres: more than the arrival distance, by which the walk of an avatar may differ
constexpr double kMargin = 3e-3;
constexpr double kMiddle = 0.75;       // of the radius: beyond the edge of the tread that was left
constexpr double kMinStepRise = 0.01;  // metres in a tick
constexpr double kTickedLength = 0.5;  // metres, through a place that is too narrow for the margin
constexpr double kEvenHeight = 1e-3;   // metres: a step that rises or sinks more is not even
constexpr double kMaxStall = 0.5;      // seconds without progress towards the waypoint
// Seconds. A walk that slides for longer may pass the obstacle at last, but a walk that begins a
// millimetre aside may not.
constexpr double kMaxSlidingStall = 0.1;
constexpr double kMinGain = 1e-3;       // metres in that time; less for a slow walk
constexpr double kMinSlideGain = 1e-4;  // metres in a tick
constexpr double kAnyLength = std::numeric_limits<double>::infinity();
constexpr int kMaxTicks = 1'000'000;  // more than an hour: the goal is unreasonably far

/// True if the feet rose or sank in a tick as on a step, or on a round or steep thing.
bool isStep(const Vec3& before, const Vec3& after) {
  return std::abs(after.y() - before.y()) > kMinStepRise;
}

int countTicks(double seconds, double tickDuration) {
  return static_cast<int>(std::ceil(seconds / tickDuration));
}

/// Notices when a walk comes no closer to its goal.
struct StallWatch {
  double minGain;      ///< metres
  int maxTicks;        ///< without such a gain
  double minDistance;  ///< distance at the last gain
  int ticks = 0;       ///< since then

  bool isStalledAt(double distance) {
    const bool gains = distance < minDistance - minGain;
    ticks = gains ? 0 : ticks + 1;
    if (gains) minDistance = distance;
    return ticks > maxTicks;
  }
};

}  // namespace

Walker::Walker(const WorldData& world, const NavigationAgent& agent)
    : world_(world), agent_(agent) {
  Spawn spawn;
  spawn.radius = agent.radius;
  spawn.height = agent.height;
  applySpawnShape(spawn, world.settings, avatar_);
  shape_ = avatar_.shape;
  wideShape_ = makePrismShape(agent.radius + kMargin, agent.height, agent.height, world.settings);
  narrowShape_ = makePrismShape(kMiddle * agent.radius, agent.height, agent.height, world.settings);
}

void Walker::collectNearObstacles() {
  if (contains(avatar_.cachedBounds, avatar_.motionBounds)) return;
  if (!avatar_.cachedBounds.empty())
    neighbourhoods_[cell_] = {avatar_.cachedBounds, std::move(avatar_.obstacles),
                              std::move(floor_)};
  if (neighbourhoods_.size() > kMaxNeighbourhoods) neighbourhoods_.clear();
  Aabb cell;
  for (int axis = 0; axis < 3; ++axis) {
    const auto index = static_cast<std::size_t>(axis);
    cell_[index] = static_cast<int>(std::floor(avatar_.footPosition[axis] / kCellSize));
    cell.min[axis] = kCellSize * cell_[index];
    cell.max[axis] = cell.min[axis] + kCellSize;
  }
  const double reach = kMaxStep + world_.settings.stepHeight + kCellMargin;
  cell.min += wideShape_->box.min - Vec3::Constant(reach);
  cell.max += wideShape_->box.max + Vec3::Constant(reach);
  Neighbourhood& found = neighbourhoods_[cell_];
  if (!contains(found.box, avatar_.motionBounds)) {
    cell.include(avatar_.motionBounds);  // a fast fall
    found = {cell, collectObstaclesInBox(world_, cell, 0), {}};
    found.floor = collectFloorFaces(found.obstacles, cell);
  }
  avatar_.cachedBounds = found.box;
  avatar_.obstacles = std::move(found.obstacles);
  floor_ = std::move(found.floor);
  neighbourhoods_.erase(cell_);
}

/// Returns the length of even floor on the way to `goal`, metres.
double Walker::measureEvenFloor(const Vec3& goal, double distance) {
  const Vec3 direction = projectToGround(goal - avatar_.footPosition) / distance;
  return computeEvenDistance(floor_, avatar_.footPosition, direction, std::min(distance, kMaxStep));
}

void Walker::prepareStep(const Vec3& velocity) {
  avatar_.desiredVelocity = velocity;
  avatar_.motionBounds = computeMotionBounds(world_.settings, avatar_);
  collectNearObstacles();
  avatar_.blockedBy = 0;
}

/// Steps if the path is free and level; false, at the same place: it is not. A move of this length
/// alone would climb and pass what a walk in short steps cannot.
bool Walker::stepEvenly(const Vec3& displacement, bool isFloorEven) {
  const Standing before = getStanding();
  prepareStep(displacement / world_.settings.tickDuration);
  const ShapeCastHit hit =
      castAvatarShape(*avatar_.shape, before.footPosition, displacement, avatar_.obstacles,
                      makeContactOffset(world_.settings), count_);
  if (hit.entity != 0) return false;
  if (isFloorEven) {
    avatar_.footPosition += displacement;
    addTravel(before.footPosition);
    return true;
  }
  isUneven_ = true;
  moveAvatar(world_, avatar_, count_);
  addTravel(before.footPosition);
  if (avatar_.blockedBy == 0 && avatar_.grounded &&
      std::abs(avatar_.footPosition.y() - before.footPosition.y()) <= kEvenHeight)
    return true;
  restore(before);
  return false;
}

void Walker::step(const Vec3& velocity) {
  const Vec3 before = avatar_.footPosition;
  prepareStep(velocity);
  moveAvatar(world_, avatar_, count_);
  addTravel(before);
}

void Walker::addTravel(const Vec3& from) {
  travel_.across += computeGroundDistance(from, avatar_.footPosition);
  travel_.climb += std::abs(avatar_.footPosition.y() - from.y());
}

/// Whether a floor on which one can stand is at most a step below the middle of the feet.
bool Walker::hasFloorBelow() {
  const Vec3 down(0, -world_.settings.stepHeight, 0);
  const ShapeCastHit hit =
      castAvatarShape(*narrowShape_, avatar_.footPosition, down, avatar_.obstacles,
                      makeContactOffset(world_.settings), count_);
  return hit.entity != 0 && hit.normal.y() >= world_.settings.walkableNormalY;
}

/// Call it in each tick in the air. Where drops of a step are allowed, a stair may be descended in
/// longer falls, onto the tread after the next.
bool Walker::hasFallen(double maxDrop) {
  lastFloor_.isOnStair =
      lastFloor_.isOnStair && maxDrop <= world_.settings.stepHeight && hasFloorBelow();
  return avatar_.footPosition.y() < lastFloor_.height - maxDrop && !lastFloor_.isOnStair;
}

std::optional<std::string> Walker::place(const Vec3& footPosition, double maxDrop) {
  if (auto error = placeStanding(world_, footPosition, avatar_, count_)) return error;
  avatar_.grounded = false;
  avatar_.fallSpeed = 0;
  const double lowest = footPosition.y() - maxDrop;
  while (!avatar_.grounded) {
    const double before = avatar_.footPosition.y();
    step(Vec3::Zero());
    if (avatar_.grounded) break;
    if (avatar_.footPosition.y() < lowest) return "the floor is too far below";
    if (before - avatar_.footPosition.y() < 1e-9 && avatar_.blockedBy != 0)
      return "it would not stand upright on " + world_.findEntityName(avatar_.blockedBy);
  }
  travel_ = {};
  return std::nullopt;
}

void Walker::returnTo(const Vec3& footPosition) {
  restore({footPosition, {}});
}

void Walker::restore(const Standing& standing) {
  avatar_.footPosition = standing.footPosition;
  avatar_.grounded = true;
  avatar_.fallSpeed = 0;
  avatar_.lastDisplacement = Vec3::Zero();  // of no walk before
  travel_ = standing.travel;
  lastFloor_ = {standing.footPosition.y()};
}

WalkOutcome Walker::walkTo(const Vec3& goal) {
  const double stepHeight = world_.settings.stepHeight;
  const Standing start = getStanding();
  hasStepped_ = isUneven_ = false;
  for (double minDistance = std::numeric_limits<double>::infinity();;) {
    avatar_.shape = wideShape_;
    WalkOutcome outcome = walkWithMargin(goal);
    avatar_.shape = shape_;
    if (outcome.kind == WalkOutcome::Kind::arrived) {
      if (!hasStepped_) return outcome;
      // Whether a step succeeds, and where it ends, may depend on where the ticks begin.
      restore(start);
      return walkByTicks(goal, kAnyLength, false, stepHeight);
    }
    outcome = walkByTicks(goal, kTickedLength, false, stepHeight);
    const double distance = computeGroundDistance(avatar_.footPosition, goal);
    if (outcome.kind != WalkOutcome::Kind::arrived) return outcome;
    if (distance <= kArrivalDistance || !(distance < minDistance)) return outcome;
    minDistance = distance;
  }
}

bool Walker::isPathClear(const Vec3& goal) {
  isUneven_ = false;
  avatar_.shape = wideShape_;
  bool isClear = true;
  while (isClear) {
    const double distance = computeGroundDistance(avatar_.footPosition, goal);
    if (distance <= kArrivalDistance) break;
    const double even = measureEvenFloor(goal, distance);
    const double length = std::min({distance, kMaxStep, std::max(kLongStep, even)});
    isClear = stepEvenly(projectToGround(goal - avatar_.footPosition) * (length / distance),
                         length <= even);
  }
  avatar_.shape = shape_;
  return isClear;
}

bool Walker::isRideFree(const Vec3& from, const Vec3& to, EntityId body) {
  Aabb swept;
  for (const Vec3& footPosition : {from, to})
    for (const Vec3& corner : {shape_->box.min, shape_->box.max})
      swept.include(footPosition + corner);
  ObstacleSet obstacles =
      collectObstaclesInBox(world_, inflate(swept, 2 * world_.settings.contactOffset), 0);
  std::erase_if(obstacles.list, [&](const Obstacle& one) { return one.entity == body; });
  std::erase_if(obstacles.dense, [&](const DenseObject& one) { return one.entity == body; });
  return castAvatarShape(*shape_, from, to - from, obstacles, makeContactOffset(world_.settings),
                         count_)
             .entity == 0;
}

/// Walks with a wider shape, in long steps where the floor is even. Ends before the first place
/// that is too narrow for it.
WalkOutcome Walker::walkWithMargin(const Vec3& goal) {
  const double tick = world_.settings.tickDuration;
  double shortDistance = 0, stepLimit = kMaxStep;
  if (avatar_.grounded) lastFloor_ = {avatar_.footPosition.y()};
  Standing stood = getStanding();
  const auto end = [&](WalkOutcome::Kind kind) {
    const WalkOutcome outcome{kind, avatar_.footPosition, avatar_.blockedBy};
    if (kind != WalkOutcome::Kind::arrived) restore(stood);
    return outcome;
  };
  for (int ticks = 0; ticks < kMaxTicks; ++ticks) {
    const double distance = computeGroundDistance(avatar_.footPosition, goal);
    if (distance <= kArrivalDistance && avatar_.grounded) return end(WalkOutcome::Kind::arrived);
    const Vec3 before = avatar_.footPosition;
    if (avatar_.grounded) stood = getStanding();
    if (shortDistance <= 0) {
      const double even = measureEvenFloor(goal, distance);
      const double length = std::min({distance, stepLimit, std::max(kLongStep, even)});
      const Vec3 displacement = projectToGround(goal - before) * (length / distance);
      if (stepEvenly(displacement, length <= even)) {
        lastFloor_ = {avatar_.footPosition.y()};
        stepLimit = std::min(kMaxStep, 2 * stepLimit);
        continue;
      }
      // An obstacle met on a very long step may lie far ahead.
      if (length > kLongStep)
        stepLimit = std::max(kLongStep, 0.25 * length);
      else
        shortDistance = 2 * kLongStep;
      continue;
    }
    isUneven_ = true;
    step(computeWalkVelocity(before, goal, false, agent_.speed, tick));
    if (!avatar_.grounded) {  // falls from tread to tread of a steep stair
      shortDistance = 2 * kLongStep;
      if (hasFallen(world_.settings.stepHeight)) return end(WalkOutcome::Kind::fell);
      if ((avatar_.footPosition - before).squaredNorm() < kMinGain * kMinGain)
        return end(WalkOutcome::Kind::blocked);
      continue;
    }
    lastFloor_ = {avatar_.footPosition.y()};
    const double across = computeGroundDistance(before, avatar_.footPosition);
    if (isStep(before, avatar_.footPosition)) hasStepped_ = crossedSteps_ = true;
    if (avatar_.blockedBy != 0) return end(WalkOutcome::Kind::blocked);
    shortDistance -= across;
  }
  return end(WalkOutcome::Kind::blocked);
}

/// Walks as an avatar in a world does, over at most `length` metres. Arrived: nothing stopped it,
/// or, if it may slide, nothing for long.
WalkOutcome Walker::walkByTicks(const Vec3& goal, double length, bool maySlide, double maxDrop) {
  const Vec3 start = avatar_.footPosition;
  if (avatar_.grounded) lastFloor_ = {start.y()};
  const double tick = world_.settings.tickDuration;
  StallWatch watch{std::min(kMinGain, 0.5 * agent_.speed * tick),
                   countTicks(maySlide ? kMaxSlidingStall : kMaxStall, tick),
                   computeGroundDistance(start, goal)};
  for (int ticks = 0;; ++ticks) {
    const double distance = computeGroundDistance(avatar_.footPosition, goal);
    const bool isThere =
        distance <= kArrivalDistance &&
        (avatar_.grounded || (maySlide && hasReachedHeight(goal, avatar_, world_.settings)));
    if (isThere ||
        (avatar_.grounded && computeGroundDistance(start, avatar_.footPosition) >= length))
      return {WalkOutcome::Kind::arrived, avatar_.footPosition, 0, ticks};
    if (watch.isStalledAt(distance))
      return {WalkOutcome::Kind::blocked, avatar_.footPosition, avatar_.groundEntity, ticks};
    const Vec3 before = avatar_.footPosition;
    step(computeWalkVelocity(before, goal, false, agent_.speed, tick));
    if (isStep(before, avatar_.footPosition)) hasStepped_ = crossedSteps_ = true;
    if (!avatar_.grounded) {
      if (hasFallen(maxDrop)) return {WalkOutcome::Kind::fell, avatar_.footPosition, 0, ticks};
      if (before.y() - avatar_.footPosition.y() > kMinStepRise) watch.ticks = 0;
      continue;
    }
    lastFloor_ = {avatar_.footPosition.y()};
    if (avatar_.blockedBy != 0 && !maySlide)
      return {WalkOutcome::Kind::blocked, avatar_.footPosition, avatar_.blockedBy, ticks};
  }
}

WalkOutcome Walker::dropTo(const Vec3& goal, double maxDrop) {
  return walkByTicks(goal, kAnyLength, false, maxDrop);
}

bool Walker::walkEvenly(const Vec3& goal) {
  hasStepped_ = isUneven_ = false;
  return walkWithMargin(goal).kind == WalkOutcome::Kind::arrived && !isUneven_;
}

WalkOutcome Walker::walkOn(const Vec3& goal, double maxLength) {
  return walkByTicks(goal, maxLength, true, world_.settings.stepHeight);
}

WalkOutcome Walker::slideTo(const Vec3& goal) {
  const double tick = world_.settings.tickDuration;
  StallWatch watch{std::min(kMinSlideGain, 0.05 * agent_.speed * tick), countTicks(kMaxStall, tick),
                   computeGroundDistance(avatar_.footPosition, goal)};
  for (int ticks = 0; ticks < kMaxTicks; ++ticks) {
    const double distance = computeGroundDistance(avatar_.footPosition, goal);
    if (distance <= kArrivalDistance && avatar_.grounded)
      return {WalkOutcome::Kind::arrived, avatar_.footPosition, 0};
    if (watch.isStalledAt(distance)) break;
    step(computeWalkVelocity(avatar_.footPosition, goal, false, agent_.speed, tick));
    if (avatar_.footPosition.y() < world_.scene->bounds().min.y())
      return {WalkOutcome::Kind::fell, avatar_.footPosition, 0};
  }
  return {WalkOutcome::Kind::blocked, avatar_.footPosition, avatar_.blockedBy};
}

}  // namespace enfilade::scene
