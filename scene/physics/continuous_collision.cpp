#include "scene/physics/continuous_collision.hpp"

#include <algorithm>
#include <utility>

#include "collision/assert.hpp"
#include "scene/base/disjoint_sets.hpp"

namespace enfilade::scene {
namespace {

using collision::InterpolatedMotion;

constexpr std::size_t kBodiesPerTask = 32;  // bodies in one task
constexpr std::size_t kScannedPairsPerTask =
    512;                                  // pairs in one task, where each costs next to nothing
constexpr double kRestGapFraction = 0.5;  // of contactOffset: bodies rest at no smaller gap
// of contactOffset per step: slow enough to count as rest (SleepSettings)
constexpr double kMaxDepenetrationFraction = 0.25;
constexpr int kPartialPasses = 4;  // after these passes a blocking body does not move at all

InterpolatedMotion makeSweptMotion(const PhysicsBody& body, const BodyMotion& goal) {
  InterpolatedMotion sweep = makeStationaryMotion(body);
  sweep.to = {goal.centre, goal.rotation};
  sweep.isStationary = false;
  updateDerived(sweep);
  return sweep;
}

/// Returns the fraction of the motion that is proved clear; 1 for a pair that was not separated.
/// `lowerBound`: of the distance at the start. `usedNarrowPhase`: set if a query ran.
double computePairClearFraction(const PhysicsWorld& world, const BodyPair& pair, double lowerBound,
                                const StepScratch& scratch, std::uint8_t& usedNarrowPhase) {
  if (pair.verdict != collision::Verdict::separated) return 1;
  const PhysicsBody &a = world.bodies[pair.key.a], &b = world.bodies[pair.key.b];
  const InterpolatedMotion& sweepA = scratch.sweptMotions[scratch.localIndices[pair.key.a]];
  const InterpolatedMotion& sweepB = scratch.sweptMotions[scratch.localIndices[pair.key.b]];
  const collision::InterpolatedShape partA{getPartShape(a, pair.key.partA), sweepA};
  const collision::InterpolatedShape partB{getPartShape(b, pair.key.partB), sweepB};
  const double fraction = pair.separatingAxis.isZero(0)
                              ? -1
                              : computeClearFractionAlong(partA, partB, pair.separatingAxis);
  if (fraction == 1) return 1;
  usedNarrowPhase = 1;
  // If they overlap at the end, the plane that separated them is as good as any.
  if (fraction >= 0 && !isSeparatedAtEnd(partA, partB, pair.features())) return fraction;
  return computeClearance(partA, partB, pair.features(), lowerBound).lo;
}

/// Shortens a motion that exceeds maxStepDisplacement. The velocity does not change.
void limitDisplacement(const PhysicsBody& body, InterpolatedMotion& sweep) {
  for (int i = 0;
       i < collision::kMaxHalvings && computeMaxDisplacement(sweep) > body.maxStepDisplacement; ++i)
    sweep = replaceEnds(sweep, sweep.from, computeMiddlePose(sweep.from, sweep.to));
  if (computeMaxDisplacement(sweep) > body.maxStepDisplacement) sweep = makeStationaryMotion(body);
}

constexpr std::uint32_t kSeveralCarriers = kNoIndex - 1;  // in place of an index

/// Returns the carrier of each island: the one kinematic body that it touches. kNoIndex: none;
/// kSeveralCarriers: more than one. A static obstacle may detach it; see detachFromCarrier().
std::vector<std::uint32_t> findCarriers(const PhysicsWorld& world, const StepScratch& scratch,
                                        DisjointSets& islands) {
  const auto bodyAt = [&](std::uint32_t body) -> const PhysicsBody& {
    return world.bodies[scratch.bodyIndices[body]];
  };
  const auto holds = [&](const ContactConstraint& constraint) {
    return scratch.released[constraint.a] == 0 && scratch.released[constraint.b] == 0;
  };
  for (const ContactConstraint& constraint : scratch.constraints)
    if (holds(constraint) && bodyAt(constraint.a).isAwake() && bodyAt(constraint.b).isAwake())
      islands.unite(constraint.a, constraint.b);
  std::vector<std::uint32_t> carriers(scratch.motions.size(), kNoIndex);
  for (const ContactConstraint& constraint : scratch.constraints) {
    const bool isFirstDynamic = bodyAt(constraint.a).isAwake();
    if (!holds(constraint) || isFirstDynamic == bodyAt(constraint.b).isAwake()) continue;
    const std::uint32_t candidate = isFirstDynamic ? constraint.b : constraint.a;
    if (scratch.sweptMotions[candidate].isStationary) continue;
    ENFILADE_ASSERT(candidate < scratch.sweptMotions.size());
    std::uint32_t& carrier = carriers[islands.find(isFirstDynamic ? constraint.a : constraint.b)];
    carrier = carrier == kNoIndex || carrier == candidate ? candidate : kSeveralCarriers;
  }
  return carriers;
}

CarrierMotion makeCarrierMotion(std::uint32_t carrier, double seconds, const StepScratch& scratch) {
  const InterpolatedMotion& sweep = scratch.sweptMotions[carrier];
  CarrierMotion carrierMotion;
  carrierMotion.carrier = carrier;
  carrierMotion.pivot = sweep.from.centre;
  carrierMotion.translation = sweep.to.centre - sweep.from.centre;
  carrierMotion.rotation = sweep.to.rotation * sweep.from.rotation.conjugate();
  carrierMotion.rotates = sweep.rotationAngle > 0;
  carrierMotion.velocity = carrierMotion.translation / seconds;
  carrierMotion.angularVelocity = scratch.motions[carrier].angularVelocity;
  return carrierMotion;
}

void assignCarriers(const PhysicsWorld& world, double seconds, StepScratch& scratch) {
  DisjointSets islands(scratch.motions.size());
  const std::vector<std::uint32_t> carriers = findCarriers(world, scratch, islands);
  scratch.carrierMotions.assign(scratch.motions.size(), {});
  for (std::uint32_t i = 0; i < scratch.motions.size(); ++i) {
    const std::uint32_t carrier = carriers[islands.find(i)];
    if (!world.bodies[scratch.bodyIndices[i]].isAwake() || carrier >= kSeveralCarriers) continue;
    if (!world.bodies[scratch.bodyIndices[carrier]].isDynamic())
      scratch.carrierMotions[i] = makeCarrierMotion(carrier, seconds, scratch);
  }
}

/// Sets the motions of all moving bodies; the others are stationary.
void computeSweptMotions(const PhysicsWorld& world, StepScratch& scratch) {
  scratch.sweptMotions.resize(scratch.motions.size());
  scratch.pool->parallelFor(
      scratch.motions.size(), kBodiesPerTask, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) {
          const PhysicsBody& body = world.bodies[scratch.bodyIndices[i]];
          const bool isMoving = body.isAwake() || body.isKinematic();
          scratch.sweptMotions[i] =
              isMoving ? makeSweptMotion(body, scratch.motions[i]) : makeStationaryMotion(body);
          if (body.isAwake()) limitDisplacement(body, scratch.sweptMotions[i]);
        }
      });
}

/// Computes for each body the displacement that restores the rest gap, half of it if the other body
/// is awake too. It serves bodies without certified motion. Otherwise a shaken heap would lock: the
/// smaller a gap, the less motion is proved, and each stopped body stops its neighbours.
void computeDepenetrations(const PhysicsWorld& world, double contactOffset, StepScratch& scratch) {
  const double restGap = kRestGapFraction * contactOffset;
  scratch.depenetrations.assign(scratch.motions.size(), Vec3::Zero());
  for (const std::uint32_t i : scratch.constrainedPairs) {
    const BodyPair& pair = world.pairs[i];
    const PhysicsBody &a = world.bodies[pair.key.a], &b = world.bodies[pair.key.b];
    const double lowerBound = computeLowerBound(pair, a, b);
    if (pair.verdict != collision::Verdict::separated || !(lowerBound < restGap)) continue;
    const double share = a.isAwake() && b.isAwake() ? 0.5 : 1;
    const Vec3 depenetration =
        share * (restGap - std::max(0.0, lowerBound)) * pair.constraint()->normal;
    scratch.depenetrations[scratch.localIndices[pair.key.a]] -= depenetration;
    scratch.depenetrations[scratch.localIndices[pair.key.b]] += depenetration;
  }
  for (Vec3& depenetration : scratch.depenetrations)
    if (const double length = depenetration.norm();
        length > kMaxDepenetrationFraction * contactOffset)
      depenetration *= kMaxDepenetrationFraction * contactOffset / length;
}

/// State of the proof passes. Most of the many pairs are far apart. They are skipped by the bounds
/// of their motion relative to the mean displacement.
struct Pass {
  std::vector<std::uint8_t> needsProof;  ///< of each body: its motion changed
  std::vector<double> minFractions;      ///< of each body: minimum over its pairs
  Vec3 meanDisplacement = Vec3::Zero();  ///< metres: mean displacement of the awake bodies
  /// of each body: metres, largest motion relative to `meanDisplacement`
  std::vector<double> relativeBounds;
  std::vector<double> teleportedDistances;  ///< of each body: copy of PhysicsBody's
  /// Indices into `activePairs` of pairs that may meet, and their distance bounds at the start.
  std::vector<std::uint32_t> nearPairs;
  std::vector<double> lowerBounds;
  std::vector<std::uint8_t> isNear;  ///< of each of `activePairs`
  /// of each of `nearPairs`: the proved fraction of the present motions
  std::vector<double> clearFractions;
  std::vector<std::uint8_t>
      usedNarrowPhase;  ///< of each of `nearPairs`: the narrow phase was queried
  /// Pairs of bodies of which neither could be reduced.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> crushed;
};

void startPasses(const PhysicsWorld& world, const StepScratch& scratch, Pass& pass) {
  pass.needsProof.assign(scratch.motions.size(), 1);
  pass.relativeBounds.assign(scratch.motions.size(), -1);
  pass.teleportedDistances.clear(), pass.nearPairs.clear(), pass.lowerBounds.clear(),
      pass.crushed.clear();
  for (const std::uint32_t body : scratch.bodyIndices)
    pass.teleportedDistances.push_back(world.bodies[body].teleportedDistance);
  pass.meanDisplacement = Vec3::Zero();
  for (std::uint32_t i = 0; i < scratch.report.awake; ++i)  // awake bodies come first
    pass.meanDisplacement +=
        scratch.sweptMotions[i].to.centre - scratch.sweptMotions[i].from.centre;
  if (scratch.report.awake > 0) pass.meanDisplacement /= scratch.report.awake;
}

/// Updates the bounds for changed motions. Returns whether a bound grew.
bool updateRelativeBounds(StepScratch& scratch, Pass& pass) {
  bool hasGrown = false;
  for (std::size_t i = 0; i < scratch.motions.size(); ++i) {
    if (pass.needsProof[i] == 0) continue;
    const collision::DisplacementBound& bound = scratch.motionBounds[i] =
        computeDisplacementBound(scratch.sweptMotions[i]);
    const double relativeBound =
        (bound.displacement - pass.meanDisplacement).norm() + bound.rotationalBound;
    if (relativeBound <= pass.relativeBounds[i]) continue;
    // A reduced motion approaches that of its carrier.
    const double carriedBound =
        (scratch.carrierMotions[i].translation - pass.meanDisplacement).norm() +
        bound.rotationalBound;
    pass.relativeBounds[i] =
        std::max(relativeBound, carriedBound) * kRoundUpFactor;  // NaN: nothing is clear of it
    hasGrown = true;
  }
  return hasGrown;
}

void findNearPairs(const PhysicsWorld& world, StepScratch& scratch, Pass& pass) {
  pass.isNear.resize(scratch.activePairs.size());
  const auto computePairBound = [&](std::size_t k) {
    const auto [a, b] = scratch.pairBodies[k];
    return computeLowerBound(world.pairs[scratch.activePairs[k]],
                             pass.teleportedDistances[a] + pass.teleportedDistances[b]);
  };
  scratch.pool->parallelFor(
      scratch.activePairs.size(), kScannedPairsPerTask, [&](std::size_t from, std::size_t to) {
        for (std::size_t k = from; k < to; ++k) {
          const auto [a, b] = scratch.pairBodies[k];
          pass.isNear[k] = !((pass.relativeBounds[a] + pass.relativeBounds[b]) * kRoundUpFactor <
                             computePairBound(k));
        }
      });
  pass.nearPairs.clear(), pass.lowerBounds.clear();
  for (std::uint32_t k = 0; k < scratch.activePairs.size(); ++k) {
    if (pass.isNear[k] == 0) continue;
    pass.nearPairs.push_back(k);
    pass.lowerBounds.push_back(computePairBound(k));
  }
}

void runProofPass(const PhysicsWorld& world, StepScratch& scratch, Pass& pass) {
  if (updateRelativeBounds(scratch, pass)) findNearPairs(world, scratch, pass);
  pass.clearFractions.assign(pass.nearPairs.size(), 1);
  pass.usedNarrowPhase.assign(pass.nearPairs.size(), 0);
  scratch.pool->parallelFor(
      pass.nearPairs.size(), kPairsPerTask, [&](std::size_t from, std::size_t to) {
        for (std::size_t n = from; n < to; ++n) {
          const std::uint32_t k = pass.nearPairs[n];
          const auto [a, b] = scratch.pairBodies[k];
          if (pass.needsProof[a] == 0 && pass.needsProof[b] == 0) continue;
          if (computeApproachBound(scratch.motionBounds[a], scratch.motionBounds[b]) <
              pass.lowerBounds[n])
            continue;
          const BodyPair& pair = world.pairs[scratch.activePairs[k]];
          pass.clearFractions[n] = computePairClearFraction(world, pair, pass.lowerBounds[n],
                                                            scratch, pass.usedNarrowPhase[n]);
        }
      });
  ENFILADE_ASSERT(std::ranges::all_of(
      pass.clearFractions, [](double fraction) { return fraction >= 0 && fraction <= 1; }));
  for (const std::uint8_t proof : pass.usedNarrowPhase) scratch.report.continuousChecks += proof;
}

/// Scales a body's motion relative to its carrier by `fraction`.
void scaleMotion(std::uint32_t body, double fraction, StepScratch& scratch) {
  ENFILADE_ASSERT(fraction >= 0 && fraction < 1);
  scratch.motionFractions[body] *= fraction;
  InterpolatedMotion& sweep = scratch.sweptMotions[body];
  const CarrierMotion& carrierMotion = scratch.carrierMotions[body];
  if (carrierMotion.carrier != kNoIndex) sweep.isStationary = false;
  sweep.to.centre -= carrierMotion.translation;
  if (carrierMotion.rotates) {
    sweep.to.centre = carrierMotion.rotation.conjugate() * (sweep.to.centre - carrierMotion.pivot) +
                      carrierMotion.pivot;
    sweep.to.rotation = carrierMotion.rotation.conjugate() * sweep.to.rotation;
  }
  updateDerived(sweep);
  sweep = truncateMotion(sweep, fraction);
  if (carrierMotion.rotates) {
    sweep.to.centre =
        carrierMotion.rotation * (sweep.to.centre - carrierMotion.pivot) + carrierMotion.pivot;
    sweep.to.rotation = (carrierMotion.rotation * sweep.to.rotation).normalized();
  }
  sweep.to.centre += carrierMotion.translation;
  updateDerived(sweep);
}

/// Stops a body that its carrier would move through an obstacle. The kinematic body may then
/// penetrate it; static bodies are never penetrated.
void detachFromCarrier(const PhysicsWorld& world, std::uint32_t body, StepScratch& scratch) {
  scratch.motionFractions[body] = 0, scratch.hasOwnMotion[body] = 0;
  scratch.carrierMotions[body] = {};
  scratch.sweptMotions[body] = makeStationaryMotion(world.bodies[scratch.bodyIndices[body]]);
}

/// Returns whether a body has motion of its own left.
bool canReduceMotion(const PhysicsWorld& world, std::uint32_t body, const StepScratch& scratch) {
  return world.bodies[scratch.bodyIndices[body]].isAwake() && scratch.hasOwnMotion[body] != 0;
}

/// Returns whether only its carrier moves the body, and `other` is neither that carrier nor carried
/// by it.
bool isCarriedInto(std::uint32_t body, std::uint32_t other, const StepScratch& scratch) {
  const std::uint32_t carrier = scratch.carrierMotions[body].carrier;
  return carrier != kNoIndex && carrier != other &&
         scratch.carrierMotions[other].carrier != carrier;
}

/// If no part of the body's motion was certified, depenetrate it once. Returns whether it moves.
bool depenetrate(std::uint32_t body, double maxDisplacement, StepScratch& scratch) {
  const Vec3 depenetration = std::exchange(scratch.depenetrations[body], Vec3::Zero());
  InterpolatedMotion sweep = scratch.sweptMotions[body];
  sweep.to.centre += depenetration;
  sweep.isStationary = false;
  updateDerived(sweep);
  if (depenetration.isZero(0) || computeMaxDisplacement(sweep) > maxDisplacement) return false;
  scratch.sweptMotions[body] = sweep;
  return true;
}

/// Reduces a body's motion to `fraction`. A body without motion of its own loses its carrier.
void reduceMotion(const PhysicsWorld& world, std::uint32_t body, double fraction,
                  StepScratch& scratch) {
  const bool hasOwnMotion = scratch.hasOwnMotion[body] != 0;
  const double maxDisplacement = world.bodies[scratch.bodyIndices[body]].maxStepDisplacement;
  if (hasOwnMotion) scaleMotion(body, fraction, scratch);
  if (hasOwnMotion && fraction == 0)
    scratch.hasOwnMotion[body] = depenetrate(body, maxDisplacement, scratch);
  if (!hasOwnMotion || computeMaxDisplacement(scratch.sweptMotions[body]) > maxDisplacement)
    detachFromCarrier(world, body, scratch);
}

/// Reduces the motions of all pairs that are not proved clear. Returns whether any was reduced.
bool reduceUnprovenMotions(const PhysicsWorld& world, bool stopEntirely, StepScratch& scratch,
                           Pass& pass) {
  pass.minFractions.assign(scratch.motions.size(), 1);
  for (std::size_t n = 0; n < pass.nearPairs.size(); ++n) {
    if (pass.clearFractions[n] == 1) continue;
    const auto [a, b] = scratch.pairBodies[pass.nearPairs[n]];
    bool reducesA = canReduceMotion(world, a, scratch),
         reducesB = canReduceMotion(world, b, scratch);
    if (!reducesA && !reducesB) {
      reducesA = isCarriedInto(a, b, scratch);
      reducesB = isCarriedInto(b, a, scratch);
    }
    const double fraction = stopEntirely ? 0 : pass.clearFractions[n];
    if (reducesA) pass.minFractions[a] = std::min(pass.minFractions[a], fraction);
    if (reducesB) pass.minFractions[b] = std::min(pass.minFractions[b], fraction);
    if (!reducesA && !reducesB)
      pass.crushed.emplace_back(scratch.bodyIndices[a], scratch.bodyIndices[b]);
  }
  scratch.pool->parallelFor(
      scratch.motions.size(), kBodiesPerTask, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) {
          pass.needsProof[i] = pass.minFractions[i] < 1;
          if (pass.needsProof[i])
            reduceMotion(world, static_cast<std::uint32_t>(i), pass.minFractions[i], scratch);
        }
      });
  return std::ranges::find(pass.needsProof, 1) != pass.needsProof.end();
}

}  // namespace

void clampToProvenMotion(const PhysicsWorld& world, double seconds, double contactOffset,
                         StepScratch& scratch) {
  scratch.motionFractions.assign(scratch.motions.size(), 1);
  scratch.hasOwnMotion.assign(scratch.motions.size(), 1);
  scratch.motionBounds.resize(scratch.motions.size());
  computeSweptMotions(world, scratch);
  assignCarriers(world, seconds, scratch);
  thread_local Pass kept;  // reused, as StepScratch is
  Pass& pass = kept;
  computeDepenetrations(world, contactOffset, scratch);
  startPasses(world, scratch, pass);
  // Each pass but the last reduces a motion (after kPartialPasses to nothing), depenetrates a body
  // once, or detaches one from its carrier.
  const std::size_t bound = 3 * scratch.motions.size() + kPartialPasses + 1;
  bool hasReduced = true;
  for (std::size_t i = 0; i < bound && hasReduced; ++i) {
    runProofPass(world, scratch, pass);
    hasReduced = reduceUnprovenMotions(world, i >= kPartialPasses, scratch, pass);
  }
  ENFILADE_ASSERT(!hasReduced);
  std::sort(pass.crushed.begin(), pass.crushed.end());
  const auto end = std::unique(pass.crushed.begin(), pass.crushed.end());
  scratch.report.crushed = static_cast<std::uint32_t>(end - pass.crushed.begin());
}

}  // namespace enfilade::scene
