// A walk yields to another one that is ahead of it within kFollowDistance and closer to its
// waypoint. The other one must walk to the same place or in about the same direction. Among walks
// to one place that is a strict order, so one of them always goes. Two more rules keep other walks
// from waiting for ever: rings are opened, and walks that wedge one another step back. Walks in
// opposite directions do not yield; they slide past each other.
#include "scene/world/avatars/yielding.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/world/avatars/walk_velocity.hpp"
#include "scene/world/contacts/obstacles.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMinGap = 0.02;  // metres between the boxes of the shapes: closer, it steps back
constexpr double kFollowDistance = 0.1;       // metres: farther, it walks at full speed
constexpr double kMinSpeedFactor = 0.15;      // slower, it stands
constexpr double kOpposedCosine = -0.9;       // of two walks that meet head-on
constexpr double kStallSeconds = 1;           // without progress: it is wedged
constexpr double kMaxRetreat = -0.5;          // of the speed
constexpr double kAheadCosine = 0.7071;       // walks in one direction: within 45 degrees of it
constexpr double kAbreastCosine = -0.1;       // walks to one place: ahead or abreast
constexpr double kSameDirectionCosine = 0.7;  // of two walks
constexpr double kSamePlace = 0.5;            // metres between two waypoints
// 10 s at 60 ticks a second. The timeout of a walk stands still if the first of its queue was free
// that recently. Longer jams end walks as blocked.
constexpr std::uint64_t kMaxQueueTicks = 600;

struct GroundWalk {
  const Vec3* goal = nullptr;      ///< null: it does not walk on the ground
  Vec3 heading = Vec3::Zero();     ///< horizontal, unit
  double distance = 0, reach = 0;  ///< metres: to the goal, and half the width of the shape's box
};

double computeHalfWidth(const Aabb& box) {
  return 0.5 * std::max(box.size().x(), box.size().z());
}

/// By index into WorldData::avatars.
std::vector<GroundWalk> findGroundWalks(const WorldData& world) {
  std::vector<GroundWalk> walks(world.avatars.size());
  for (const OrderQueue& queue : world.queues) {
    const Avatar* avatar = world.findAvatar(queue.avatar);
    if (queue.orders.empty() || !avatar || avatar->flying || avatar->walk.minDistance < 0) continue;
    const Walk* walk = std::get_if<Walk>(&queue.orders.front().order);
    if (!walk) continue;
    const Vec3& goal = walk->waypoints[avatar->walk.waypointIndex];
    const double distance = computeGroundDistance(avatar->footPosition, goal);
    if (!(distance > 0)) continue;
    walks[static_cast<std::size_t>(avatar - world.avatars.data())] = {
        &goal, projectToGround(goal - avatar->footPosition) / distance, distance,
        computeHalfWidth(avatar->shape->box)};
  }
  return walks;
}

/// Minimum cosine between the walk's direction and that to another walk to yield to it; 2: never.
double computeMinCosine(const GroundWalk& walk, const GroundWalk& other) {
  if (computeGroundDistance(*walk.goal, *other.goal) <= kSamePlace) return kAbreastCosine;
  return walk.heading.dot(other.heading) > kSameDirectionCosine ? kAheadCosine : 2;
}

/// Metres between the boxes of two walkers, on the ground.
double computeGap(const Avatar& a, const GroundWalk& walkOfA, const Avatar& b,
                  const GroundWalk& walkOfB) {
  return computeGroundDistance(a.footPosition, b.footPosition) - walkOfA.reach - walkOfB.reach;
}

/// Metres between the avatars if `avatar` must yield to `other`; otherwise infinite.
double computeGapAhead(const Avatar& avatar, const GroundWalk& walk, const Avatar& other,
                       const GroundWalk& otherWalk) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  if (!otherWalk.goal) return kNone;
  const double between = computeGroundDistance(avatar.footPosition, other.footPosition);
  const Vec3 toOther = projectToGround(other.footPosition - avatar.footPosition);
  if (!(toOther.dot(walk.heading) > computeMinCosine(walk, otherWalk) * between)) return kNone;
  const double distanceOfOther = computeGroundDistance(other.footPosition, *walk.goal);
  const bool isCloser =
      distanceOfOther < walk.distance || (distanceOfOther == walk.distance && other.id < avatar.id);
  return isCloser ? computeGap(avatar, walk, other, otherWalk) : kNone;
}

/// Walks that wedge one another, as in the arch that a crowd forms in front of a door. One that
/// makes no progress yields to a neighbour that is closer to its own waypoint. Infinite: not to
/// this one.
double computeGapToUnwedge(const Avatar& avatar, const GroundWalk& walk, const Avatar& other,
                           const GroundWalk& otherWalk) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  if (!otherWalk.goal || walk.heading.dot(otherWalk.heading) < kOpposedCosine) return kNone;
  const bool isCloser = otherWalk.distance < walk.distance ||
                        (otherWalk.distance == walk.distance && other.id < avatar.id);
  return isCloser ? computeGap(avatar, walk, other, otherWalk) : kNone;
}

bool isStalled(const WorldSettings& settings, const Avatar& avatar) {
  return avatar.walk.timeoutLeft <
         settings.stuckTimeout - std::min(kStallSeconds, 0.5 * settings.stuckTimeout);
}

constexpr std::size_t kNobody = std::numeric_limits<std::size_t>::max();

struct Leader {
  std::size_t index = kNobody;   ///< into WorldData::avatars
  double gap = kFollowDistance;  ///< metres
};

/// The closest walk that the avatar yields to.
Leader findLeader(const WorldData& world, const std::vector<GroundWalk>& walks,
                  const Avatar& avatar, const GroundWalk& walk) {
  Leader leader;
  const bool stalled = isStalled(world.settings, avatar);
  for (const auto& overlap :
       world.broadPhase.getDynamicOverlaps(avatar.proxy)) {  // of the last tick
    const Avatar* other = world.findAvatarByProxy(overlap.id);
    if (!other) continue;
    const auto index = static_cast<std::size_t>(other - world.avatars.data());
    double gap = computeGapAhead(avatar, walk, *other, walks[index]);
    if (stalled) gap = std::min(gap, computeGapToUnwedge(avatar, walk, *other, walks[index]));
    if (gap < kFollowDistance && gap <= leader.gap) leader = {index, gap};
  }
  return leader;
}

/// Walks to different waypoints may wait for one another in a ring, and would do so for ever: the
/// one closest to its waypoint goes.
void openRings(std::vector<Leader>& leaders, const std::vector<GroundWalk>& walks) {
  std::vector<std::size_t> visit(leaders.size(), kNobody);  // the first walk whose chain led here
  for (std::size_t first = 0; first < leaders.size(); ++first) {
    std::size_t at = first;
    while (at != kNobody && visit[at] == kNobody) {
      visit[at] = first;
      at = leaders[at].index;
    }
    if (at == kNobody || visit[at] != first) continue;
    std::size_t closest = at;
    for (std::size_t next = leaders[at].index; next != at; next = leaders[next].index)
      if (walks[next].distance < walks[closest].distance) closest = next;
    leaders[closest] = {};
  }
}

/// The walk in whose queue the avatar waits: its leader, or who blocks it and waits itself.
const Avatar* findQueueAhead(const WorldData& world, const std::vector<Leader>& leaders,
                             std::size_t index) {
  if (leaders[index].index != kNobody) return &world.avatars[leaders[index].index];
  const Avatar* blocking = world.findAvatar(world.avatars[index].blockedBy);
  if (!blocking) return nullptr;
  const auto i = static_cast<std::size_t>(blocking - world.avatars.data());
  return leaders[i].index != kNobody ? blocking : nullptr;
}

/// Negative: it steps back, as the one ahead may need the place, such as the waypoint itself.
double computeSpeedFactor(double gap) {
  const double factor = std::max(kMaxRetreat, (gap - kMinGap) / (kFollowDistance - kMinGap));
  return std::abs(factor) < kMinSpeedFactor ? 0 : factor;
}

}  // namespace

void yieldToWalkersAhead(WorldData& world) {
  const std::vector<GroundWalk> walks = findGroundWalks(world);
  std::vector<Leader> leaders(walks.size());
  for (std::size_t i = 0; i < walks.size(); ++i)
    if (walks[i].goal) leaders[i] = findLeader(world, walks, world.avatars[i], walks[i]);
  openRings(leaders, walks);
  for (std::size_t i = 0; i < walks.size(); ++i) {
    if (!walks[i].goal) continue;
    Avatar& avatar = world.avatars[i];
    const Leader& leader = leaders[i];
    const Avatar* ahead = findQueueAhead(world, leaders, i);
    avatar.walk.yields = ahead != nullptr;
    avatar.walk.flowTick = ahead ? ahead->walk.flowTick : world.tick;
    if (leader.index != kNobody) avatar.desiredVelocity *= computeSpeedFactor(leader.gap);
  }
}

bool mayPassEarly(const WorldData& world, const Avatar& avatar, double distance, const Vec3& next,
                  QueryCount& count) {
  const bool isCrowded = avatar.walk.yields || avatar.blockedBy >= world.firstAvatarId();
  const double width = 2 * computeHalfWidth(avatar.shape->box);
  if (!isCrowded || avatar.flying || distance > width) return false;
  // As far as beyond the corner that the waypoint may mark.
  Vec3 onward = projectToGround(next - avatar.footPosition);
  const double length = onward.norm();
  if (length > 2 * width) onward *= 2 * width / length;
  Aabb box = placeBox(avatar.shape->box, avatar.footPosition);
  box.include(placeBox(avatar.shape->box, avatar.footPosition + onward));
  ObstacleSet obstacles =
      collectObstaclesInBox(world, inflate(box, 2 * world.settings.contactOffset), avatar.id);
  std::erase_if(obstacles.list,
                [&](const Obstacle& one) { return one.entity >= world.firstAvatarId(); });
  return castAvatarShape(*avatar.shape, avatar.footPosition, onward, obstacles,
                         makeContactOffset(world.settings), count)
             .entity == 0;
}

bool isQueueing(const WorldData& world, const Avatar& avatar) {
  return avatar.walk.yields && world.tick - avatar.walk.flowTick <= kMaxQueueTicks;
}

}  // namespace enfilade::scene
