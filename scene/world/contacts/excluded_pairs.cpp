#include "scene/world/contacts/excluded_pairs.hpp"

#include <algorithm>

#include "collision/compound/nearest_parts.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "scene/world/data/body.hpp"

namespace enfilade::scene {
namespace {

using CompoundViews = std::vector<collision::CompoundView>;

/// Work limit of one pair, in units of findNearestParts(). A pair that exceeds it is not excluded.
/// Touching pairs need far less.
constexpr std::size_t kMaxPairWork = 1'000'000;

CompoundViews makeBodyAtStart(const Scene& scene, std::uint32_t body) {
  return {makeCompoundView(*scene.bodyShape(body), computeStartPose(scene.model().bodies[body]))};
}

CompoundViews makeEntityAtStart(const Scene& scene, EntityId entity) {
  const auto& bodies = scene.model().bodies;
  for (std::uint32_t i = 0; i < bodies.size(); ++i)
    if (bodies[i].objects[0] + 1 == entity) return makeBodyAtStart(scene, i);
  return makeCompoundViews(scene.collisionGeometry(entity - 1));
}

bool areCloserThan(const CompoundViews& a, const CompoundViews& b, double contact) {
  std::size_t budget = kMaxPairWork;
  const collision::NearestParts nearest = collision::findNearestParts(a, b, contact, budget);
  if (nearest.outcome != collision::NearestParts::Outcome::nearest) return false;
  collision::FeatureCache cache;
  return collision::isCloserThan(nearest.separation, nearest.a, nearest.b, contact, cache);
}

}  // namespace

bool isExcludedPair(const Scene& scene, std::uint32_t body, EntityId other, double contact) {
  return areCloserThan(makeBodyAtStart(scene, body), makeEntityAtStart(scene, other), contact);
}

std::vector<EntityId> findExcludedPartners(const Scene& scene, std::uint32_t body, double contact) {
  std::vector<EntityId> excluded;
  const auto& bodies = scene.model().bodies;
  if (!isKinematic(bodies[body].kind)) return excluded;
  const CompoundViews own = makeBodyAtStart(scene, body);
  const Aabb searchBox = inflate(collision::computeAabb(own[0]), contact);
  const auto& solidObjects = scene.solidObjects();
  for (std::size_t i = 0; i < solidObjects.size(); ++i)
    if (overlaps(searchBox, scene.staticBoxes()[i]) &&
        areCloserThan(own, makeCompoundViews(scene.collisionGeometry(solidObjects[i])), contact))
      excluded.push_back(solidObjects[i] + 1);
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    if (i == body || !isKinematic(bodies[i].kind)) continue;
    const CompoundViews other = makeBodyAtStart(scene, i);
    if (overlaps(searchBox, collision::computeAabb(other[0])) && areCloserThan(own, other, contact))
      excluded.push_back(bodies[i].objects[0] + 1);
  }
  std::sort(excluded.begin(), excluded.end());
  return excluded;
}

}  // namespace enfilade::scene
