// Clearance around positions: NarrowPlace (narrowest position of a path), GapAxis and
// ObstacleDistance, measured with a thin prism above the step height.
#pragma once

#include <optional>
#include <vector>

#include "scene/navigation/mesh/agent.hpp"
#include "scene/navigation/walk/walker.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

inline constexpr double kMaxSideWidth = 3;  ///< metres to each side: larger is not measured

/// The narrowest position of a path.
struct NarrowPlace {
  Vec3 position = Vec3::Zero();  ///< feet, scene frame, metres
  double clearWidth = 0;         ///< metres, measured across the path above the step height
};

/// The line through the middle of a gap, on which its width is least.
struct GapAxis {
  Vec3 centre = Vec3::Zero();     ///< feet, scene frame, metres
  Vec3 direction = Vec3::Zero();  ///< horizontal unit vector, through the gap
  double clearWidth = 0;          ///< metres, measured across the direction
};

/// Distance of a standing agent from the closest thing that it could walk into.
struct ObstacleDistance {
  double distance = 0;  ///< metres from the agent's axis, above the step height
  EntityId entity = 0;  ///< 0: none within the searched distance
};

/// A thin prism from the step height to the height of the agent, and where its feet are for an
/// agent at `footPosition`.
std::shared_ptr<const AvatarShape> makeThinShape(const WorldSettings& settings,
                                                 const NavigationAgent& agent);
inline Vec3 placeThinShape(const WorldSettings& settings, const Vec3& footPosition) {
  return footPosition + Vec3(0, settings.stepHeight + 1e-4, 0);
}

/// The places of a walk along the points of a path, some centimetres apart, with the heights of the
/// feet. On stairs, the line between two points is above or below them. The rest of a leg that is
/// not walked, such as a ride or a fall, is one line.
std::vector<Vec3> traceFeet(Walker& walker, const std::vector<Vec3>& points);

/// The narrowest place of a line of places, of those within `maxDistance` metres of `near`.
/// Infinite width: none was measured.
NarrowPlace measureNarrowest(const WorldData& world, const NavigationAgent& agent,
                             const std::vector<Vec3>& points, const Vec3& near, double maxDistance);

/// The axis of the gap at `place` (the line of least width, GapAxis), within 30 degrees of the
/// horizontal unit vector `direction`.
/// nullopt: the gap is narrower than the agent, or nothing bounds it.
std::optional<GapAxis> measureGapAxis(const WorldData& world, const NavigationAgent& agent,
                                      const Vec3& place, const Vec3& direction);

/// The closest obstacle of an agent that stands at `footPosition`, up to `maxDistance` metres.
ObstacleDistance measureObstacle(const WorldData& world, const NavigationAgent& agent,
                                 const Vec3& footPosition, double maxDistance);

}  // namespace enfilade::scene
