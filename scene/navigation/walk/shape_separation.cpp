#include "scene/navigation/walk/shape_separation.hpp"

#include <limits>

#include "scene/world/queries/proximity_query.hpp"

namespace enfilade::scene {

std::optional<collision::SeparationResult> computeSeparationFromShape(
    EntityIndex& index, const Snapshot& snapshot, std::shared_ptr<const AvatarShape> shape,
    const Vec3& footPosition, EntityId entity) {
  AvatarSnapshot avatar;
  avatar.id = std::numeric_limits<EntityId>::max();
  avatar.footPosition = footPosition;
  avatar.shape = std::move(shape);
  Snapshot with = snapshot;
  with.avatars = {avatar};
  std::size_t budget = kMaxQueryWork;
  const auto found = computePairProximity({index, with}, avatar.id, entity, false, budget);
  if (const auto* pair = std::get_if<PairProximity>(&found)) return pair->separation;
  return std::nullopt;
}

}  // namespace enfilade::scene
