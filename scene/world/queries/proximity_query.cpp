#include "scene/world/queries/proximity_query.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

#include "collision/compound/nearest_parts.hpp"
#include "collision/narrow_phase/refine.hpp"

namespace enfilade::scene {
namespace {

using collision::NearestParts;
using Outcome = NearestParts::Outcome;

constexpr double kUnlimitedDistance = std::numeric_limits<double>::infinity();

bool spendWork(std::size_t& budget, std::size_t cost) {
  if (budget < cost) return false;
  budget -= cost;
  return true;
}

std::size_t computeRefinementWork(const NearestParts& parts) {
  if (parts.separation.verdict != collision::Verdict::penetrating) return kRefinementWork;
  return kRefinementWork + kDepthWork * parts.a.vertices.size() * parts.b.vertices.size();
}

void refineProximity(PairProximity& proximity, const NearestParts& parts) {
  constexpr double kRelative = 1e-15;
  collision::FeatureCache cache;
  const collision::RefinedSeparation exact = collision::refineSeparation(parts.a, parts.b, cache);
  proximity.separation.verdict = exact.verdict;
  proximity.separation.certificate = exact.certificate;
  proximity.separation.featureA = exact.featureA;
  proximity.separation.featureB = exact.featureB;
  proximity.separation.distance = exact.distance;
  proximity.separation.errorBound = kRelative * exact.distance;
  proximity.separation.pointA = exact.pointA;
  proximity.separation.pointB = exact.pointB;
  if (exact.distance > 0) proximity.separation.normal = exact.closest.normalized();
  proximity.penetration = exact.penetration;
}

struct Candidate {
  double gap;  ///< metres, between the AABBs
  EntityId id;
};

/// All entities whose AABB is within `within` of a box, nearest first. Triggers are skipped: they
/// are not solid.
std::vector<Candidate> findCandidates(const SceneAt& sceneAt, const Aabb& box, double within,
                                      EntityId ignoredEntity) {
  std::vector<Candidate> candidates;
  const auto consider = [&](EntityId id, const Aabb& other) {
    const double gap = computeGap(box, other);
    if (gap <= within && id != ignoredEntity) candidates.push_back({gap, id});
  };
  const auto& solidObjects = sceneAt.scene().solidObjects();
  for (std::size_t i = 0; i < solidObjects.size(); ++i)
    consider(solidObjects[i] + 1, sceneAt.scene().staticBoxes()[i]);
  for (const BodySnapshot& body : *sceneAt.snapshot.bodies)
    if (!isTrigger(sceneAt.scene().model().bodies[body.index].kind))
      consider(body.id, computeBodyAabb(sceneAt, body));
  for (const AvatarSnapshot& avatar : sceneAt.snapshot.avatars)
    consider(avatar.id, placeBoxOutward(avatar.shape->box, avatar.footPosition));
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& x, const Candidate& y) {
    return std::tuple(x.gap, x.id) < std::tuple(y.gap, y.id);
  });
  return candidates;
}

bool isWithin(const NearestParts& parts, double within) {
  if (parts.outcome != Outcome::nearest) return false;
  if (parts.separation.verdict != collision::Verdict::separated) return true;
  collision::FeatureCache cache;
  return collision::isCloserThan(parts.separation, parts.a, parts.b, within, cache);
}

bool isBefore(const PairProximity& x, const PairProximity& y) {
  const auto order = [](const PairProximity& one) {
    return std::tuple(-static_cast<int>(one.separation.verdict), one.separation.distance, one.b);
  };
  return order(x) < order(y);
}

}  // namespace

QueryError makeTooComplexError(const char* field) {
  return {QueryError::Reason::tooComplex, field,
          "exceeds the work limit of one query: ask for fewer pairs or smaller objects"};
}

std::variant<PlacedEntity, QueryError> findSolidParts(const SceneAt& sceneAt, EntityId entity,
                                                      const char* field) {
  PlacedEntity placed = makePlacedEntity(sceneAt, entity);
  if (placed.partCount > 0) return placed;
  return QueryError{QueryError::Reason::notSolid, field,
                    "is not solid: it has no area, or is only drawn"};
}

std::variant<PairProximity, QueryError> computePairProximity(const SceneAt& sceneAt, EntityId a,
                                                             EntityId b, bool refined,
                                                             std::size_t& budget) {
  const auto first = findSolidParts(sceneAt, a, "a"), second = findSolidParts(sceneAt, b, "b");
  for (const auto* one : {&first, &second})
    if (const auto* error = std::get_if<QueryError>(one)) return *error;
  const NearestParts parts = collision::findNearestParts(std::get<PlacedEntity>(first).compounds,
                                                         std::get<PlacedEntity>(second).compounds,
                                                         kUnlimitedDistance, budget);
  if (parts.outcome != Outcome::nearest) return makeTooComplexError("b");
  PairProximity proximity{a, b, parts.separation, 0};
  if (refined && !spendWork(budget, computeRefinementWork(parts))) return makeTooComplexError("b");
  if (refined) refineProximity(proximity, parts);
  return proximity;
}

std::variant<NearbyEntities, QueryError> findNearbyEntities(const SceneAt& sceneAt, EntityId entity,
                                                            double within, std::size_t& budget) {
  const auto solid = findSolidParts(sceneAt, entity, "entity");
  if (const auto* error = std::get_if<QueryError>(&solid)) return *error;
  const auto& own = std::get<PlacedEntity>(solid);
  // AABBs that are apart by rounding only may belong to shapes that touch.
  const double searchDistance = within + 1e-9 * (1 + own.box.max.cwiseAbs().maxCoeff());
  NearbyEntities result;
  for (const Candidate& candidate : findCandidates(sceneAt, own.box, searchDistance, entity)) {
    std::size_t entityBudget = std::min(budget, kMaxWorkPerEntity);
    const std::size_t before = entityBudget;
    const PlacedEntity other = makePlacedEntity(sceneAt, candidate.id);
    const NearestParts parts =
        collision::findNearestParts(own.compounds, other.compounds, within, entityBudget);
    budget -= before - entityBudget;
    if (parts.outcome == Outcome::budgetExhausted) ++result.skipped;
    if (isWithin(parts, within))
      result.pairs.push_back({entity, candidate.id, parts.separation, 0});
  }
  std::stable_sort(result.pairs.begin(), result.pairs.end(), isBefore);
  return result;
}

}  // namespace enfilade::scene
