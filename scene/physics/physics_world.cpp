// Steps
//  1. Pairs of an awake body are looked at (near_pair.hpp). An awake body that leans on one asleep
//     wakes it, whose pairs are then looked at, too.
//  2. The solver moves the awake bodies and all that they may meet (solver.hpp).
//  3. Every pair that could have met on the way is proved clear (passage.hpp); where that fails,
//     the free bodies go only as far as is proved, and less fast; then their other pairs are looked
//     at again, until nobody needs to stop. It ends, since a body goes less far each time, and
//     after a few times not at all. Who goes not at all is parted, once, from what is too near. A
//     group that leans on one driven body and nothing else that stands or is driven, such as parts
//     in a tray, goes with it at least.
//  4. Groups of bodies that lean on one another and were calm for a while fall asleep.
#include "scene/physics/physics_world.hpp"

#include <algorithm>
#include <cmath>

#include "scene/physics/disjoint_sets.hpp"
#include "scene/physics/step_scratch.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kAskedAhead = 4;   // pairs
constexpr std::size_t kKeyBlock = 1024;  // pairs that a thread takes at a time to find them again

NearPairStep nearStep(const DynamicsStep& settings) {
  return {settings.solver.seconds, settings.solver.gravity, settings.solver.epsilon};
}

bool mayMatter(const Pace& a, const Pace& b) {
  return a.isAwake || b.isAwake || (a.isMoved && b.isFree) || (b.isMoved && a.isFree);
}
bool mayMatter(const Solid& a, const Solid& b) {
  return mayMatter(paceOf(a, Vec3::Zero()), paceOf(b, Vec3::Zero()));
}

void wake(Solid& solid) {
  solid.asleep = false;
  solid.calmFor = 0;
}

// ---- step 1 ------------------------------------------------------------------------------------

/// Metres that a point of the solid gets `towards` (unit) in the step by the motion of now, at
/// most.
double advanceOf(const Solid& solid, const Vec3& arm, const Vec3& towards, double seconds) {
  if (solid.asleep) return 0;
  const auto& mean = solid.motion;
  const Vec3 velocity = mean.velocity + mean.spin.cross(arm) + solid.pushVelocity;
  double most = std::max(solid.pushed, towards.dot(velocity)) * seconds, way = 0;
  for (const Gait& gait : solid.gaits) {
    way += towards.dot(gait.velocity + gait.spin.cross(arm)) * seconds /
           static_cast<double>(solid.gaits.size());
    most = std::max(most, way);
  }
  return most;
}

/// Whether the points of its patch lean on one another, or will in the step. One of both sleeps.
bool comesToLean(const NearPair& pair, const Solid& a, const Solid& b, const NearPairStep& step) {
  const ContactPatch& patch = *pair.patch();
  for (const PatchPoint& point : patch.list()) {
    const double advance = advanceOf(a, point.armA, patch.normal, step.seconds) +
                           advanceOf(b, point.armB, -patch.normal, step.seconds);
    if (point.separation < 2 * step.epsilon + advance) return true;
  }
  return false;
}

/// Of all solids, beside the mean velocity of those that are awake.
void findPaces(const Dynamics& dynamics, StepWork& work) {
  Vec3 sum = Vec3::Zero();
  double awake = 0;
  for (const Solid& solid : dynamics.solids)
    if (solid.isAwake()) sum += solid.motion.velocity, ++awake;
  const Vec3 mean = awake > 0 ? Vec3(sum / awake) : sum;
  work.paces.clear();
  for (const Solid& solid : dynamics.solids) work.paces.push_back(paceOf(solid, mean));
}

/// Looks at a pair, and changes nothing else; flags.
std::uint8_t lookAt(const Dynamics& dynamics, const StepWork& work, NearPair& pair,
                    const NearPairStep& step) {
  const Pace &paceA = work.paces[pair.key.a], &paceB = work.paces[pair.key.b];
  if (!mayMatter(paceA, paceB)) return 0;
  std::uint8_t flags = StepWork::kActive;
  const Solid &a = dynamics.solids[pair.key.a], &b = dynamics.solids[pair.key.b];
  if (areFar(pair, paceA, paceB, step)) {
    pair.hasPatch = false;
  } else if (look(pair, a, b, step)) {
    flags |= StepWork::kAsked;
  }
  if (pair.penetration() > 0) flags |= StepWork::kPenetrates;
  if (!pair.hasPatch) return flags;
  flags |= StepWork::kPatched;
  if (leans(pair, step.epsilon)) flags |= StepWork::kLeans;
  const bool sleeper = (a.isFree() && a.asleep) || (b.isFree() && b.asleep);
  if (sleeper && comesToLean(pair, a, b, step)) flags |= StepWork::kWakes;
  return flags;
}

/// Takes over what a round of looks found. Returns whether somebody woke.
bool takeLook(Dynamics& dynamics, const NearPair& pair, std::uint8_t& flags, StepWork& work) {
  if ((flags & StepWork::kAsked) != 0) ++work.report.looks;
  if ((flags & StepWork::kPenetrates) != 0)
    work.report.deepest = std::max(work.report.deepest, pair.penetration());
  const bool wakes = (flags & StepWork::kWakes) != 0;
  flags &= StepWork::kActive | StepWork::kLeans | StepWork::kPatched;
  if (!wakes) return false;
  Solid &a = dynamics.solids[pair.key.a], &b = dynamics.solids[pair.key.b];
  wake(a.isFree() && a.asleep ? a : b);
  return true;
}

void wakeJointed(Dynamics& dynamics) {
  for (const Joint& joint : dynamics.joints) {
    Solid &a = dynamics.solids[joint.a], &b = dynamics.solids[joint.b];
    if (a.isAwake() && b.asleep) wake(b);
    if (b.isAwake() && a.asleep) wake(a);
  }
}

/// Asks the memory for what is known of a pair that may lean: such lie all over it.
void askFor(const NearPair& pair) {
  if (!pair.hasPatch) return;
  const auto* bytes = reinterpret_cast<const char*>(pair.close.get());
  for (std::size_t i = 0; i < sizeof(CloseUp); i += 64) __builtin_prefetch(bytes + i);
}

void findPatches(Dynamics& dynamics, const NearPairStep& step, StepWork& work) {
  wakeJointed(dynamics);
  std::vector<NearPair>& pairs = dynamics.pairs;
  work.looks.assign(pairs.size(), 0);
  std::vector<std::uint8_t> isNew(pairs.size(), 1);
  // Each round but the last wakes a solid.
  for (std::size_t round = 0; round <= dynamics.solids.size(); ++round) {
    findPaces(dynamics, work);
    work.workers->share(pairs.size(), kPairBlock, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        if (i + kAskedAhead < to) askFor(pairs[i + kAskedAhead]);
        if (isNew[i]) work.looks[i] = lookAt(dynamics, work, pairs[i], step);
      }
    });
    bool woken = false;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (!isNew[i] || work.looks[i] == 0) continue;
      isNew[i] = 0;
      woken = takeLook(dynamics, pairs[i], work.looks[i], work) || woken;
    }
    if (!woken) break;
  }
  for (std::uint32_t i = 0; i < pairs.size(); ++i) {
    if (work.looks[i] == 0) continue;
    work.active.push_back(i);
    if ((work.looks[i] & StepWork::kPatched) != 0) work.patched.push_back(i);
  }
}

// ---- step 2 ------------------------------------------------------------------------------------

void addBody(const Dynamics& dynamics, std::uint32_t solid, StepWork& work) {
  if (work.local[solid] != kNoPlace) return;
  work.local[solid] = static_cast<std::uint32_t>(work.bodies.size());
  work.solids.push_back(solid);
  work.bodies.push_back(dynamics.solids[solid].motion);
  const Solid& added = dynamics.solids[solid];
  if (!added.isFree() && !added.gaits.empty())
    work.driven.push_back({work.local[solid], added.gaits});
  RigidBody& body = work.bodies.back();
  if (!dynamics.solids[solid].asleep) return;
  body.inverseMass = 0;  // it stands
  body.velocity = body.spin = Vec3::Zero();
}

void gatherBodies(const Dynamics& dynamics, StepWork& work) {
  work.local.assign(dynamics.solids.size(), kNoPlace);
  for (std::uint32_t i = 0; i < dynamics.solids.size(); ++i)
    if (dynamics.solids[i].isAwake()) addBody(dynamics, i, work);
  work.report.awake = static_cast<std::uint32_t>(work.bodies.size());
  work.bodiesOf.reserve(work.active.size());
  for (const std::uint32_t i : work.active) {
    const PartPairKey& key = dynamics.pairs[i].key;
    addBody(dynamics, key.a, work);
    addBody(dynamics, key.b, work);
    work.bodiesOf.push_back({work.local[key.a], work.local[key.b]});
  }
}

void gatherPatches(const Dynamics& dynamics, StepWork& work) {
  work.patches.resize(work.patched.size());
  work.workers->share(work.patched.size(), kPairBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) {
      const NearPair& pair = dynamics.pairs[work.patched[k]];
      work.patches[k] = *pair.patch();
      work.patches[k].a = work.local[pair.key.a];
      work.patches[k].b = work.local[pair.key.b];
    }
  });
  for (const std::uint32_t i : work.patched)
    if (work.leans(i)) ++work.report.leaning;
  work.report.patches = static_cast<std::uint32_t>(work.patches.size());
}

void findInside(const Dynamics& dynamics, StepWork& work) {
  work.letOut.assign(work.bodies.size(), 0);
  for (std::uint32_t k = 0; k < work.patched.size(); ++k) {
    const NearPair& pair = dynamics.pairs[work.patched[k]];
    const Solid &a = dynamics.solids[pair.key.a], &b = dynamics.solids[pair.key.b];
    if (!isInDriven(pair, a, b)) continue;
    work.inside.push_back(k);
    const ContactPatch& patch = work.patches[k];
    if (isLetOut(pair, a, b)) work.letOut[a.isFree() ? patch.a : patch.b] = 1;
  }
}

void gatherJoints(const Dynamics& dynamics, StepWork& work) {
  for (std::uint32_t i = 0; i < dynamics.joints.size(); ++i) {
    const Joint& joint = dynamics.joints[i];
    const Solid &a = dynamics.solids[joint.a], &b = dynamics.solids[joint.b];
    if (!mayMatter(a, b)) continue;
    addBody(dynamics, joint.a, work);
    addBody(dynamics, joint.b, work);
    work.joints.push_back(joint);
    work.joints.back().a = work.local[joint.a];
    work.joints.back().b = work.local[joint.b];
    work.jointOf.push_back(i);
  }
}

/// Metres that a patch's points come nearer on the ways of its bodies; < 0: they part.
double comesNearer(const ContactPatch& patch, const StepWork& work) {
  const auto wayOf = [&](std::uint32_t body, const Vec3& arm) -> Vec3 {
    const Passage& way = work.passages[body];
    const Vec3 inFrame = way.fromTurned.transpose() * arm;
    return way.toCentre - way.fromCentre + (way.toTurned - way.fromTurned) * inFrame;
  };
  double most = -std::numeric_limits<double>::infinity();
  for (const PatchPoint& point : patch.list()) {
    const Vec3 way = wayOf(patch.a, point.armA) - wayOf(patch.b, point.armB);
    most = std::max(most, patch.normal.dot(way));
  }
  return most;
}

/// Of each of `bodies`: a driven one goes deeper into it, or into what it leans on. Between two
/// that cannot yield impulses grow without bound: kept, they would fling whoever comes free.
std::vector<std::uint8_t> whoStartsCold(const Dynamics& dynamics, const StepWork& work) {
  const auto isAwake = [&](std::uint32_t i) { return dynamics.solids[work.solids[i]].isAwake(); };
  std::vector<std::uint8_t> cold(work.bodies.size(), 0);
  for (const std::uint32_t k : work.inside) {
    const ContactPatch& patch = work.patches[k];
    if (comesNearer(patch, work) > 0) cold[isAwake(patch.a) ? patch.a : patch.b] = 1;
  }
  if (std::ranges::find(cold, 1) == cold.end()) return cold;
  Islands islands(work.bodies.size());
  const auto join = [&](const auto& link) {
    if (isAwake(link.a) && isAwake(link.b)) islands.join(link.a, link.b);
  };
  for (const ContactPatch& patch : work.patches) join(patch);
  for (const Joint& joint : work.joints) join(joint);
  for (std::uint32_t i = 0; i < cold.size(); ++i)
    if (cold[i] != 0) cold[islands.leaderOf(i)] = 1;
  for (std::uint32_t i = 0; i < cold.size(); ++i) cold[i] = cold[islands.leaderOf(i)];
  return cold;
}

void keepImpulses(Dynamics& dynamics, const StepWork& work) {
  const std::vector<std::uint8_t> cold = whoStartsCold(dynamics, work);
  const auto isKept = [&](const auto& link) { return cold[link.a] == 0 && cold[link.b] == 0; };
  const ContactPatch nothing;
  work.workers->share(work.patches.size(), kPairBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) {
      NearPair& pair = dynamics.pairs[work.patched[k]];
      pair.met = work.patches[k].pushed;
      ContactPatch& patch = *pair.patch();
      const ContactPatch& solved = isKept(work.patches[k]) ? work.patches[k] : nothing;
      for (std::size_t i = 0; i < patch.size; ++i) {
        patch.points[i].impulse = solved.points[i].impulse;
        patch.points[i].push = solved.points[i].push;
      }
      patch.rub = solved.rub;
      patch.twist = solved.twist;
    }
  });
  for (std::size_t k = 0; k < work.joints.size(); ++k) {
    const Joint& joint = work.joints[k];
    dynamics.joints[work.jointOf[k]].impulses = isKept(joint) ? joint.impulses : Joint{}.impulses;
  }
}

// ---- after step 3 ------------------------------------------------------------------------------

void setOut(Dynamics& dynamics, StepWork& work) {
  for (std::size_t i = 0; i < work.bodies.size(); ++i) {
    Solid& solid = dynamics.solids[work.solids[i]];
    const bool isAwake = solid.isAwake();
    if (!isAwake && !solid.isDriven()) continue;
    const Passage& way = work.passages[i];
    solid.motion.centre = way.toCentre, solid.motion.rotation = way.toRotation;
    if (isAwake) {
      const Carry& carry = work.carried[i];
      const Vec3 with = carry.velocityAt(way.fromCentre);
      solid.motion.velocity = with + work.fractions[i] * (work.bodies[i].velocity - with);
      solid.motion.spin = carry.spin + work.fractions[i] * (work.bodies[i].spin - carry.spin);
      if (work.fractions[i] < 1) ++work.report.shortened;
    }
    solid.odometer += lengthOf(way);
    placeSolid(solid);
  }
  work.workers->share(work.active.size(), kPairBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) {
      double& apart = dynamics.pairs[work.active[k]].apart;
      const auto [a, b] = work.bodiesOf[k];
      const double closing = closingOf(work.strides[a], work.strides[b]);
      apart -= closing + 0x1p-51 * (std::abs(apart) + closing);
    }
  });
}

// ---- step 4 ------------------------------------------------------------------------------------

Islands findIslands(const Dynamics& dynamics, const StepWork& work) {
  Islands islands(dynamics.solids.size());
  for (const std::uint32_t i : work.patched) {
    const NearPair& pair = dynamics.pairs[i];
    if (!dynamics.solids[pair.key.a].isAwake() || !dynamics.solids[pair.key.b].isAwake()) continue;
    if (work.leans(i)) islands.join(pair.key.a, pair.key.b);
  }
  for (const Joint& joint : dynamics.joints)
    if (dynamics.solids[joint.a].isAwake() && dynamics.solids[joint.b].isAwake())
      islands.join(joint.a, joint.b);
  return islands;
}

std::vector<std::uint8_t> whoLeansOnRestless(const Dynamics& dynamics, const StepWork& work) {
  std::vector<std::uint8_t> restless(dynamics.solids.size(), 0);
  for (const std::uint32_t i : work.patched) {
    const NearPair& pair = dynamics.pairs[i];
    const bool a = dynamics.solids[pair.key.a].restless, b = dynamics.solids[pair.key.b].restless;
    if ((!a && !b) || !work.leans(i)) continue;
    restless[a ? pair.key.b : pair.key.a] = 1;
  }
  return restless;
}

void rest(Dynamics& dynamics, const DynamicsStep& settings, StepWork& work) {
  Islands islands = findIslands(dynamics, work);
  const std::vector<std::uint8_t> restless = whoLeansOnRestless(dynamics, work);
  std::vector<double> calm(dynamics.solids.size(), settings.rest.calmFor);
  for (std::uint32_t i = 0; i < dynamics.solids.size(); ++i) {
    Solid& solid = dynamics.solids[i];
    if (!solid.isAwake()) continue;
    // By how far it went, not by its speed: who is stopped on every way is at rest, too.
    const double went = lengthOf(work.passages[work.local[i]]);
    const bool isCalm = went < settings.rest.calmSpeed * settings.solver.seconds && !restless[i];
    solid.calmFor = isCalm ? solid.calmFor + settings.solver.seconds : 0;
    double& least = calm[islands.leaderOf(i)];
    least = std::min(least, solid.calmFor);
    if (islands.leaderOf(i) == i) ++work.report.islands;
  }
  for (std::uint32_t i = 0; i < dynamics.solids.size(); ++i) {
    Solid& solid = dynamics.solids[i];
    if (!solid.isAwake() || calm[islands.leaderOf(i)] < settings.rest.calmFor) continue;
    solid.asleep = true;
    solid.motion.velocity = solid.motion.spin = Vec3::Zero();
  }
}

}  // namespace

ReachSphere reachSphere(const Solid& solid) {
  return {solid.motion.centre, solid.radius + solid.leash};
}

void setPairs(Dynamics& dynamics, std::span<const PartPairKey> candidates, Workers* workers) {
  thread_local std::vector<NearPair> kept;  // as StepWork
  std::vector<NearPair>& pairs = kept;      // which threads that help can see
  pairs.resize(candidates.size());
  shareAmong(workers, candidates.size(), kKeyBlock, [&](std::size_t from, std::size_t to) {
    auto old = std::ranges::lower_bound(dynamics.pairs, candidates[from], {}, &NearPair::key);
    for (std::size_t i = from; i < to; ++i) {
      while (old != dynamics.pairs.end() && old->key < candidates[i]) ++old;
      if (old != dynamics.pairs.end() && old->key == candidates[i]) {
        pairs[i] = std::move(*old);
      } else {
        pairs[i].key = candidates[i];
      }
      pairs[i].met = false;
    }
  });
  std::swap(dynamics.pairs, pairs);
  pairs.clear();
}

DynamicsReport step(Dynamics& dynamics, const DynamicsStep& settings) {
  Workers alone(1);
  thread_local StepWork kept;
  StepWork& work = kept;  // which threads that help can see
  work.begin(settings.workers ? *settings.workers : alone);
  findPatches(dynamics, nearStep(settings), work);
  gatherBodies(dynamics, work);
  gatherPatches(dynamics, work);
  gatherJoints(dynamics, work);
  findInside(dynamics, work);
  solve(work.bodies, work.patches, work.joints, work.driven, settings.solver, *work.workers);
  proveWays(dynamics, settings.solver.seconds, settings.solver.epsilon, work);
  keepImpulses(dynamics, work);
  setOut(dynamics, work);
  rest(dynamics, settings, work);
  return work.report;
}

void forgetPairsOf(Dynamics& dynamics, std::uint32_t solid) {
  std::erase_if(dynamics.pairs,
                [&](const NearPair& pair) { return pair.key.a == solid || pair.key.b == solid; });
}

}  // namespace enfilade::scene
