#include "scene/navigation/ghost.hpp"

#include <limits>

#include "scene/world/queries/proximity_query.hpp"

namespace enfilade::scene {

std::optional<collision::SeparationResult> computeSeparationFromShape(
    EntityIndex& index, const Snapshot& snapshot, std::shared_ptr<const AvatarShape> shape,
    const Vec3& footPosition, EntityId entity) {
  AvatarSnapshot ghost;
  ghost.id = std::numeric_limits<EntityId>::max();
  ghost.footPosition = footPosition;
  ghost.shape = std::move(shape);
  Snapshot with = snapshot;
  with.avatars = {ghost};
  std::size_t budget = kMaxQueryWork;
  const auto found = computePairProximity({index, with}, ghost.id, entity, false, budget);
  if (const auto* pair = std::get_if<PairProximity>(&found)) return pair->separation;
  return std::nullopt;
}

}  // namespace enfilade::scene
