// A walk yields to another one that is ahead of it within kFollowDistance, is closer to its way
// point, and walks to the same place or in about the same direction. Among walks to one place
// that is a strict order, so one of them always goes. Walks in opposite directions do not yield;
// they slide past each other.
#include "scene/world/avatars/yielding.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMinGap = 0.02;  // metres between the boxes of the shapes: closer, it steps back
constexpr double kFollowDistance = 0.1;       // metres: farther, it walks at full speed
constexpr double kMinSpeedFactor = 0.05;      // slower, it stands
constexpr double kMaxRetreat = -0.5;          // of the speed
constexpr double kAheadCosine = 0.7071;       // walks in one direction: within 45 degrees of it
constexpr double kAbreastCosine = -0.1;       // walks to one place: ahead or abreast
constexpr double kSameDirectionCosine = 0.7;  // of two walks
constexpr double kSamePlace = 0.5;            // metres between two way points
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
  return isCloser ? between - walk.reach - otherWalk.reach : kNone;
}

struct Leader {
  const Avatar* avatar = nullptr;
  double gap = kFollowDistance;  ///< metres
};

/// The closest walk that the avatar yields to.
Leader findLeader(const WorldData& world, const std::vector<GroundWalk>& walks,
                  const Avatar& avatar, const GroundWalk& walk) {
  Leader leader;
  for (const auto& overlap :
       world.broadPhase.dynamicOverlapsOf(avatar.proxy)) {  // of the last tick
    const Avatar* other = world.findAvatarByProxy(overlap.id);
    if (!other) continue;
    const double gap = computeGapAhead(
        avatar, walk, *other, walks[static_cast<std::size_t>(other - world.avatars.data())]);
    if (gap < kFollowDistance && gap <= leader.gap) leader = {other, gap};
  }
  return leader;
}

/// Negative: it steps back, as the one ahead may need the place, such as the way point itself.
double computeSpeedFactor(double gap) {
  const double factor = std::max(kMaxRetreat, (gap - kMinGap) / (kFollowDistance - kMinGap));
  return std::abs(factor) < kMinSpeedFactor ? 0 : factor;
}

}  // namespace

void yieldToWalkersAhead(WorldData& world) {
  const std::vector<GroundWalk> walks = findGroundWalks(world);
  for (std::size_t i = 0; i < walks.size(); ++i) {
    if (!walks[i].goal) continue;
    Avatar& avatar = world.avatars[i];
    const Leader leader = findLeader(world, walks, avatar, walks[i]);
    avatar.walk.yields = leader.avatar != nullptr;
    avatar.walk.flowTick = leader.avatar ? leader.avatar->walk.flowTick : world.tick;
    if (!leader.avatar) continue;
    avatar.desiredVelocity *= computeSpeedFactor(leader.gap);
  }
}

double computePassingDistance(const WorldData& world, const Avatar& avatar) {
  const bool isCrowded = avatar.walk.yields || avatar.blockedBy >= world.firstAvatarId();
  return isCrowded && !avatar.flying ? 2 * computeHalfWidth(avatar.shape->box) : kArrivalDistance;
}

bool isQueueing(const WorldData& world, const Avatar& avatar) {
  return avatar.walk.yields && world.tick - avatar.walk.flowTick <= kMaxQueueTicks;
}

}  // namespace enfilade::scene
