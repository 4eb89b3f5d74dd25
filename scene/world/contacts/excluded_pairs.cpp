#include "scene/world/contacts/excluded_pairs.hpp"

#include <algorithm>

#include "collision/narrow_phase/refine.hpp"

namespace enfilade::scene {
namespace {

using Trees = std::vector<collision::TreeOfParts>;

/// Of one pair, as nearestParts() counts it: what is not decided by then is not mounted, whoever
/// asks. Pairs that touch are decided sooner by far.
constexpr std::size_t kMostWork = 1'000'000;

Trees bodyAtStart(const Scene& scene, std::uint32_t body) {
  return {treeAt(*scene.shapeOfBody(body), startPoseOf(scene.model().bodies[body]))};
}

Trees atStart(const Scene& scene, EntityId entity) {
  const auto& bodies = scene.model().bodies;
  for (std::uint32_t i = 0; i < bodies.size(); ++i)
    if (bodies[i].objects[0] + 1 == entity) return bodyAtStart(scene, i);
  return treesOf(scene.parts(entity - 1));
}

bool areNearer(const Trees& a, const Trees& b, double contact) {
  std::size_t work = kMostWork;
  const collision::NearestParts nearest = collision::nearestParts(a, b, contact, work);
  if (nearest.found != collision::NearestParts::Found::nearest) return false;
  collision::FeatureCache cache;
  return collision::isNearerThan(nearest.decision, nearest.a, nearest.b, contact, cache);
}

}  // namespace

bool isMountedOn(const Scene& scene, std::uint32_t body, EntityId other, double contact) {
  return areNearer(bodyAtStart(scene, body), atStart(scene, other), contact);
}

std::vector<EntityId> mountingOf(const Scene& scene, std::uint32_t body, double contact) {
  std::vector<EntityId> mounting;
  const auto& bodies = scene.model().bodies;
  if (!isKinematic(bodies[body].kind)) return mounting;
  const Trees own = bodyAtStart(scene, body);
  const Box lookout = grown(collision::boxOf(own[0]), contact);
  const auto& solids = scene.solidObjects();
  for (std::size_t i = 0; i < solids.size(); ++i)
    if (overlaps(lookout, scene.stillBoxes()[i]) &&
        areNearer(own, treesOf(scene.parts(solids[i])), contact))
      mounting.push_back(solids[i] + 1);
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    if (i == body || !isKinematic(bodies[i].kind)) continue;
    const Trees other = bodyAtStart(scene, i);
    if (overlaps(lookout, collision::boxOf(other[0])) && areNearer(own, other, contact))
      mounting.push_back(bodies[i].objects[0] + 1);
  }
  std::sort(mounting.begin(), mounting.end());
  return mounting;
}

}  // namespace enfilade::scene
