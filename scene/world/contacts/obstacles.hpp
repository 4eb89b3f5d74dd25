// What one mover could meet in one tick: hulls and triangles of still objects, parts of bodies,
// hulls of other avatars.
#pragma once

#include <span>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"
#include "collision/motion/shape_cast.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"
#include "scene/world/avatars/avatar_shape.hpp"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"
#include "scene/world/data/world_settings.hpp"

namespace enfilade::scene {

/// Of Obstacle::body: it is no body's part.
inline constexpr std::uint32_t kNoBody = 0xFFFF'FFFFu;

/// A convex piece of an entity, and last tick's separating axis towards it.
struct Obstacle {
  EntityId entity = 0;
  std::uint32_t part = 0;          ///< of a still object (see ObjectParts), a body or an avatar
  std::uint32_t ofBody = kNoBody;  ///< index into WorldState::bodies
  Box box;                         ///< world, metres
  collision::ConvexBody body;
  collision::FeatureCache cache;                    ///< of the avatar's first part
  std::vector<collision::FeatureCache> moreCaches;  ///< of its other parts, once they were near

  collision::FeatureCache& cacheOf(std::size_t avatarPart) {
    if (avatarPart == 0) return cache;
    if (moreCaches.size() < avatarPart) moreCaches.resize(avatarPart);
    return moreCaches[avatarPart - 1];
  }
};

/// Narrow-phase work done, for the tick's counters.
struct QueryCount {
  std::uint32_t narrow = 0;
  std::uint32_t rational = 0;
  std::uint32_t bounded = 0;  ///< sweeps that stopped at their iteration bound
};

/// The earliest thing in the way of a move.
struct Stop {
  double fraction = 1;         ///< of the displacement that may be made
  EntityId entity = 0;         ///< 0: nothing in the way
  Vec3 normal = Vec3::Zero();  ///< unit, from the obstacle to the avatar
  double distance = 0;         ///< metres, at the stop
  collision::Decision atStop;  ///< from the avatar to the obstacle
};

/// Moves the shape at `feet` by `displacement` as far as `obstacles` allow.
Stop sweepShape(const AvatarShape& shape, const Vec3& feet, const Vec3& displacement,
                std::vector<Obstacle>& obstacles, const collision::StoppingBand& band,
                QueryCount& count);

/// Whether the shape at `feet` keeps at least `clearance` metres from every obstacle; if not,
/// `nearest` names one that is nearer (deepest first is not promised).
bool isFree(const AvatarShape& shape, const Vec3& feet, double clearance,
            std::vector<Obstacle>& obstacles, QueryCount& count, EntityId& nearest);

/// A move stops at about `high`, but only what would come nearer than `low` stops it.
inline collision::StoppingBand bandOf(const Lengths& lengths) {
  return {7.0 / 8 * lengths.epsilon, (1 + 1.0 / 32) * lengths.epsilon};
}

/// Where the feet may go so that the body stays inside `reach`, where its obstacles were collected,
/// with `clearance` metres to spare.
Box feetRoomIn(const Box& reach, const Box& shapeBox, double clearance);

/// The part of a displacement, 0..1, that keeps the feet in their room.
double partInside(const Box& room, const Vec3& feet, const Vec3& displacement);

/// Appends the parts of still object `object` that `reach` may meet.
void gatherStill(const Scene& scene, std::uint32_t object, const Box& reach,
                 std::vector<Obstacle>& obstacles);

}  // namespace enfilade::scene
