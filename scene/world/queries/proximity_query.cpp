#include "scene/world/queries/proximity_query.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

#include "collision/narrow_phase/refine.hpp"

namespace enfilade::scene {
namespace {

using collision::NearestParts;
using Found = NearestParts::Found;

constexpr double kAnyDistance = std::numeric_limits<double>::infinity();

bool take(std::size_t& work, std::size_t cost) {
  if (work < cost) return false;
  work -= cost;
  return true;
}

std::size_t refinementWork(const NearestParts& parts) {
  if (parts.decision.verdict != collision::Verdict::penetrating) return kRefinementWork;
  return kRefinementWork + kDepthWork * parts.a.vertices.size() * parts.b.vertices.size();
}

void refineInto(PairState& state, const NearestParts& parts) {
  constexpr double kRelative = 1e-15;
  collision::FeatureCache cache;
  const collision::Refinement exact = collision::refine(parts.a, parts.b, cache);
  state.decision.verdict = exact.verdict;
  state.decision.decidedBy = exact.decidedBy;
  state.decision.featureA = exact.featureA;
  state.decision.featureB = exact.featureB;
  state.decision.distance = exact.distance;
  state.decision.errorBound = kRelative * exact.distance;
  state.decision.pointA = exact.pointA;
  state.decision.pointB = exact.pointB;
  if (exact.distance > 0) state.decision.normal = exact.closest.normalized();
  state.penetration = exact.penetration;
}

struct Candidate {
  double gap;  ///< metres, of the boxes
  EntityId id;
};

/// All that may be within `within` of a box, but for triggers, which are not solid; the nearest
/// boxes first.
std::vector<Candidate> candidatesNear(const SceneThen& then, const Box& box, double within,
                                      EntityId except) {
  std::vector<Candidate> candidates;
  const auto consider = [&](EntityId id, const Box& other) {
    const double gap = gapOf(box, other);
    if (gap <= within && id != except) candidates.push_back({gap, id});
  };
  const auto& solids = then.scene().solidObjects();
  for (std::size_t i = 0; i < solids.size(); ++i)
    consider(solids[i] + 1, then.scene().stillBoxes()[i]);
  for (const BodyView& body : *then.snapshot.bodies)
    if (then.scene().model().bodies[body.index].kind != BodyKind::trigger)
      consider(body.id, boxOf(then, body));
  for (const AvatarView& avatar : then.snapshot.avatars)
    consider(avatar.id, boxAt(avatar.shape->box, avatar.feet));
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& x, const Candidate& y) {
    return std::tuple(x.gap, x.id) < std::tuple(y.gap, y.id);
  });
  return candidates;
}

bool isWithin(const NearestParts& parts, double within) {
  if (parts.found != Found::nearest) return false;
  if (parts.decision.verdict != collision::Verdict::separated) return true;
  collision::FeatureCache cache;
  return collision::isNearerThan(parts.decision, parts.a, parts.b, within, cache);
}

bool isBefore(const PairState& x, const PairState& y) {
  const auto order = [](const PairState& one) {
    return std::tuple(-static_cast<int>(one.decision.verdict), one.decision.distance, one.b);
  };
  return order(x) < order(y);
}

}  // namespace

NoAnswer tooComplex(const char* field) {
  return {NoAnswer::Why::tooComplex, field,
          "needs more work than one answer is given: ask for fewer pairs, or for smaller pieces"};
}

std::variant<Placed, NoAnswer> solidParts(const SceneThen& then, EntityId entity,
                                          const char* field) {
  Placed placed = placedParts(then, entity);
  if (placed.parts > 0) return placed;
  return NoAnswer{NoAnswer::Why::notSolid, field,
                  "is nothing that can be touched: it has no area, or is only drawn"};
}

std::variant<PairState, NoAnswer> stateOfPair(const SceneThen& then, EntityId a, EntityId b,
                                              bool refined, std::size_t& work) {
  const auto first = solidParts(then, a, "a"), second = solidParts(then, b, "b");
  for (const auto* one : {&first, &second})
    if (const auto* why = std::get_if<NoAnswer>(one)) return *why;
  const NearestParts parts = collision::nearestParts(
      std::get<Placed>(first).trees, std::get<Placed>(second).trees, kAnyDistance, work);
  if (parts.found != Found::nearest) return tooComplex("b");
  PairState state{a, b, parts.decision, 0};
  if (refined && !take(work, refinementWork(parts))) return tooComplex("b");
  if (refined) refineInto(state, parts);
  return state;
}

std::variant<Near, NoAnswer> nearTo(const SceneThen& then, EntityId entity, double within,
                                    std::size_t& work) {
  const auto solid = solidParts(then, entity, "entity");
  if (const auto* why = std::get_if<NoAnswer>(&solid)) return *why;
  const auto& own = std::get<Placed>(solid);
  // Boxes that are a rounding apart may be of things that touch.
  const double lookout = within + 1e-9 * (1 + own.box.max.cwiseAbs().maxCoeff());
  Near near;
  for (const Candidate& candidate : candidatesNear(then, own.box, lookout, entity)) {
    std::size_t share = std::min(work, kMostWorkOfNear);
    const std::size_t before = share;
    const Placed other = placedParts(then, candidate.id);
    const NearestParts parts = collision::nearestParts(own.trees, other.trees, within, share);
    work -= before - share;
    if (parts.found == Found::gaveUp) ++near.leftOut;
    if (isWithin(parts, within)) near.found.push_back({entity, candidate.id, parts.decision, 0});
  }
  std::stable_sort(near.found.begin(), near.found.end(), isBefore);
  return near;
}

}  // namespace enfilade::scene
