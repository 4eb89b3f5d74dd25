// The state that contact horizons read of a snapshot: boxes, speed limits and the last motion of
// entities.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "collision/shapes/box_tree.hpp"
#include "scene/world/queries/entity_index.hpp"
#include "scene/world/queries/motion_limits.hpp"

namespace enfilade::scene {

/// The entities of a snapshot as contact horizons see them. Follows a world from snapshot to
/// snapshot.
class HorizonState {
 public:
  HorizonState(std::shared_ptr<const Scene> scene, const WorldSettings& settings);

  /// Advances to a snapshot. All entities count as moved if it is not the successor of the last.
  void update(std::shared_ptr<const Snapshot> snapshot);
  /// Forgets the last snapshot.
  void reset() { snapshot_.reset(); }

  /// Null before the first update.
  const std::shared_ptr<const Snapshot>& snapshot() const { return snapshot_; }
  SceneAt sceneAt() const { return {index_, *snapshot_}; }
  /// Avatars that left at the last update.
  const std::vector<EntityId>& left() const { return left_; }
  /// Avatars that joined or were teleported at the last update, or began to stand on a dynamic
  /// body. Earlier bounds of their motion do not hold.
  const std::vector<EntityId>& unbounded() const { return unbounded_; }

  /// Last tick in which the entity changed its pose, shape or ground; 0 for static objects.
  std::uint64_t lastMotion(EntityId entity) const;
  /// Last tick in which any kinematic body moved.
  std::uint64_t lastKinematicMotion() const { return kinematicMotion_; }

  Aabb computeBox(EntityId entity) const;
  /// Maximum speed of the entity during the next `seconds`, under any command; infinity for dynamic
  /// bodies.
  double computeMaxSpeedWithin(EntityId entity, double seconds) const;
  /// Metres by which the entity may grow at once.
  double getGrowthLimit(EntityId entity) const;

  /// A solid entity with bounded motion.
  struct Neighbour {
    EntityId entity;
    double earliest;  ///< seconds from now: there is no contact before, by the boxes
  };
  /// All of them that may come into contact with the avatar within `seconds`.
  std::vector<Neighbour> findNeighbours(const AvatarSnapshot& avatar, double seconds) const;
  /// Number of solid entities with bounded motion.
  std::size_t boundedCount() const;
  /// Seconds during which the boxes of two entities prove that there is no contact. `speed`: the
  /// sum of both.
  double computeBoxSeparatedUntil(EntityId a, EntityId b, double speed) const;
  /// Time until a gap (metres, proved) closes to a contact.
  double computeTime(EntityId a, EntityId b, double gap, double speed) const;

  struct NearestBody {
    EntityId entity = 0;  ///< 0: no body
    /// Metres between the boxes, rounded down by up to an eighth. It thus changes seldom, and holds
    /// in every tick.
    double gap = 0;
  };
  NearestBody findNearestDynamicBody(const AvatarSnapshot& avatar) const;

 private:
  struct BodyState {
    Aabb box;
    double speed = 0;  ///< m/s, any point, under any command
    std::uint64_t lastMotion = 0;
  };

  bool isConsecutive(const Snapshot& next) const;
  void updateBodies(const Snapshot& next, bool consecutive);
  void updateAvatars(const Snapshot& next, bool consecutive);
  double computeBoxSeparatedUntil(const Aabb& own, const Aabb& other, double growth,
                                  double speed) const;
  double computeTime(double gap, double growth, double speed) const;
  double computeMaxAvatarSpeed(const AvatarSnapshot& avatar, double seconds) const;
  void findStaticNeighbours(const AvatarSnapshot& avatar, double speed, double seconds,
                            std::vector<Neighbour>& neighbours) const;

  std::shared_ptr<const Scene> scene_;
  WorldSettings settings_;
  mutable EntityIndex index_;
  collision::BoxTree staticTree_;  ///< of Scene::staticBoxes()
  std::shared_ptr<const Snapshot> snapshot_;
  std::vector<BodyState> bodies_;      ///< in the order of Model::bodies
  std::vector<AvatarPusher> pushers_;  ///< the kinematic bodies
  std::map<EntityId, std::uint64_t> avatarMotion_;
  std::uint64_t kinematicMotion_ = 0;
  std::vector<EntityId> left_, unbounded_;
  /// Speeds at this snapshot, by avatar and seconds.
  mutable std::map<std::pair<EntityId, double>, double> speeds_;
};

}  // namespace enfilade::scene
