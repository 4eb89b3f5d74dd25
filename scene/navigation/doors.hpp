// Doors for navigation: the snapshot in which all doors are open, and the closed doors on a path.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "scene/navigation/mesh/agent.hpp"
#include "scene/navigation/path_finder.hpp"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"
#include "scene/world/data/world_settings.hpp"
#include "scene/world/queries/entity_index.hpp"

namespace enfilade::scene {

bool hasDoors(const Scene& scene);

/// Opens all doors of a new world, waits until they stand still, and returns
/// its state.
std::shared_ptr<const Snapshot> makeSnapshotWithOpenDoors(std::shared_ptr<const Scene> scene,
                                                          const WorldSettings& settings);

/// `present` with the doors as in `open`: all other bodies stand where they are.
Snapshot takeDoors(const Scene& scene, Snapshot present, const Snapshot& open);

struct DoorOnPath {
  std::uint32_t body = 0;    ///< index into Model::bodies
  std::size_t point = 0;     ///< index of the first point of the line on which it stands
  double distance = 0;       ///< metres along the points from the start of the path to its contact
  double onLine = 0;         ///< metres of it from that point
  double secondsToOpen = 0;  ///< at its own speed, from where it is
  bool isInTheWay = false;   ///< as it is now
};

/// Doors that an agent on the path would touch as they are in `snapshot`, or if they were closed,
/// in the order of the path. `legs`: of the path; their distances are metres walked, as its length.
std::vector<DoorOnPath> findDoorsOnPath(EntityIndex& index, const WorldSettings& settings,
                                        const Snapshot& snapshot, const AvatarShape& agent,
                                        const std::vector<Vec3>& points,
                                        std::span<const PathLeg> legs = {});

/// Both ends of a straight line through the middle of a closed door, at right angles to its leaf.
/// They are `reach` metres before and behind it, for feet at `height`.
std::vector<Vec3> findDoorway(const Scene& scene, std::uint32_t door, double height, double reach);

/// The space that a door sweeps over while it opens from where it is in a snapshot.
class DoorSwing {
 public:
  /// `body`: index into Model::bodies. The index must outlive the swing.
  DoorSwing(EntityIndex& index, const WorldSettings& settings, const Snapshot& snapshot,
            const NavigationAgent& agent, std::uint32_t body);

  DoorSwing(DoorSwing&&) = default;
  DoorSwing(const DoorSwing&) = delete;  // it would share the door
  DoorSwing& operator=(const DoorSwing&) = delete;

  /// Whether the door comes within 1 cm of an agent at `feet`.
  bool touches(const Vec3& footPosition);
  const BodySpec& spec() const { return spec_; }

 private:
  double measureDistance(const Vec3& footPosition, double jointPosition);

  EntityIndex& index_;
  const BodySpec& spec_;
  std::shared_ptr<std::vector<BodySnapshot>> bodies_;
  Snapshot moved_;  ///< has `bodies_`, with the door elsewhere
  std::shared_ptr<const AvatarShape> prism_;
  BodySnapshot& door_;        ///< of `bodies_`
  double from_ = 0, to_ = 0;  ///< joint positions
  double distance_ = 0;       ///< metres: at least what any of its points moves in between
};

/// False: the next door stands on the same line. Such doors, as the leaves of one, open together.
bool isLastOnLine(const std::vector<DoorOnPath>& doors, std::size_t index);

}  // namespace enfilade::scene
