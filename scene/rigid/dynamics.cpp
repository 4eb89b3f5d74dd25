// Steps
//  1. Pairs of an awake body are looked at (near_pair.hpp). An awake body that leans on one asleep
//     wakes it, whose pairs are then looked at, too.
//  2. The solver moves the awake bodies and all that they may meet (solver.hpp).
//  3. Every pair that could have met on the way is proved clear (passage.hpp); where that fails,
//  the
//     free bodies go only as far as is proved, and less fast; then their other pairs are looked at
//     again, until nobody needs to stop. It ends, since a body goes less far each time, and after a
//     few times not at all. A group that leans on one driven body and nothing else that stands or
//     is driven, such as parts in a tray, goes with it at least.
//  4. Groups of bodies that lean on one another and were calm for a while fall asleep.
#include "scene/rigid/dynamics.hpp"

#include <algorithm>

#include "scene/rigid/islands.hpp"
#include "scene/rigid/passage.hpp"

namespace enfilade::scene {
namespace {

constexpr int kPartialRounds = 4;  // of step 3; then who is in the way does not move at all

constexpr std::uint32_t kNone = ~0u;

/// What belongs to one step.
struct Work {
  DynamicsReport report;
  std::vector<std::uint32_t> active;   ///< indices of pairs that were looked at or may matter
  std::vector<std::uint8_t> isActive;  ///< of each pair
  std::vector<std::uint32_t> local;    ///< of each solid: its place in `bodies`; kNone: none
  std::vector<std::uint32_t> solids;   ///< of each of `bodies`
  std::vector<RigidBody> bodies;
  std::vector<ContactPatch> patches;
  std::vector<std::uint32_t> patchPairs;
  std::vector<Joint> joints;
  std::vector<std::uint32_t> jointOf;
  std::vector<double> fractions;  ///< of each of `bodies`, of its way
  std::vector<Passage> passages;
  std::vector<Vec3> carried;  ///< of each of `bodies`: metres that it goes in any case
};

NearPairStep nearStep(const DynamicsStep& settings) {
  return {settings.solver.seconds, settings.solver.gravity, settings.solver.epsilon};
}

bool mayMatter(const Solid& a, const Solid& b) {
  return a.isAwake() || b.isAwake() || (a.isMoved() && b.isFree()) || (b.isMoved() && a.isFree());
}

void wake(Solid& solid) {
  solid.asleep = false;
  solid.calmFor = 0;
}

// ---- step 1 ------------------------------------------------------------------------------------

/// Whether the points lean on one another, or will at the end of the step by the motion of now.
bool comesToLean(const NearPair& pair, const Solid& a, const Solid& b, const NearPairStep& step) {
  const auto velocityAt = [](const Solid& s, const Vec3& arm) {
    if (s.asleep) return Vec3(Vec3::Zero());
    return Vec3(s.motion.velocity + s.motion.spin.cross(arm) + s.pushVelocity);
  };
  for (const PatchPoint& point : pair.patch.list()) {
    const Vec3 opening = velocityAt(b, point.armB) - velocityAt(a, point.armA);
    const double closing = std::max(0.0, -pair.patch.normal.dot(opening));
    if (point.separation < 2 * step.epsilon + step.seconds * closing) return true;
  }
  return false;
}

/// Looks at a pair; wakes who is leant on. Returns whether somebody woke.
bool lookAt(Dynamics& dynamics, NearPair& pair, const NearPairStep& step, Work& work) {
  Solid &a = dynamics.solids[pair.key.a], &b = dynamics.solids[pair.key.b];
  if (look(pair, a, b, step)) ++work.report.looks;
  work.report.deepest = std::max(work.report.deepest, pair.penetration);
  const bool sleeperA = a.isFree() && a.asleep, sleeperB = b.isFree() && b.asleep;
  if ((!sleeperA && !sleeperB) || !comesToLean(pair, a, b, step)) return false;
  wake(sleeperA ? a : b);
  return true;
}

void wakeJointed(Dynamics& dynamics) {
  for (const Joint& joint : dynamics.joints) {
    Solid &a = dynamics.solids[joint.a], &b = dynamics.solids[joint.b];
    if (a.isAwake() && b.asleep) wake(b);
    if (b.isAwake() && a.asleep) wake(a);
  }
}

void findPatches(Dynamics& dynamics, const NearPairStep& step, Work& work) {
  wakeJointed(dynamics);
  work.isActive.assign(dynamics.pairs.size(), 0);
  // Each round but the last wakes a solid.
  for (std::size_t round = 0; round <= dynamics.solids.size(); ++round) {
    bool woken = false;
    for (std::size_t i = 0; i < dynamics.pairs.size(); ++i) {
      NearPair& pair = dynamics.pairs[i];
      if (work.isActive[i]) continue;
      if (!mayMatter(dynamics.solids[pair.key.a], dynamics.solids[pair.key.b])) continue;
      work.isActive[i] = 1;
      woken = lookAt(dynamics, pair, step, work) || woken;
    }
    if (!woken) break;
  }
  for (std::uint32_t i = 0; i < dynamics.pairs.size(); ++i)
    if (work.isActive[i]) work.active.push_back(i);
}

// ---- step 2 ------------------------------------------------------------------------------------

void addBody(const Dynamics& dynamics, std::uint32_t solid, Work& work) {
  if (work.local[solid] != kNone) return;
  work.local[solid] = static_cast<std::uint32_t>(work.bodies.size());
  work.solids.push_back(solid);
  work.bodies.push_back(dynamics.solids[solid].motion);
  RigidBody& body = work.bodies.back();
  if (!dynamics.solids[solid].asleep) return;
  body.inverseMass = 0;  // it stands
  body.velocity = body.spin = Vec3::Zero();
}

void gatherBodies(const Dynamics& dynamics, Work& work) {
  work.local.assign(dynamics.solids.size(), kNone);
  for (std::uint32_t i = 0; i < dynamics.solids.size(); ++i)
    if (dynamics.solids[i].isAwake()) addBody(dynamics, i, work);
  work.report.awake = static_cast<std::uint32_t>(work.bodies.size());
  for (const std::uint32_t i : work.active) {
    addBody(dynamics, dynamics.pairs[i].key.a, work);
    addBody(dynamics, dynamics.pairs[i].key.b, work);
  }
}

void gatherPatches(const Dynamics& dynamics, double epsilon, Work& work) {
  work.patches.reserve(work.active.size());
  for (const std::uint32_t i : work.active) {
    const NearPair& pair = dynamics.pairs[i];
    if (pair.patch.size == 0) continue;
    work.patches.push_back(pair.patch);
    work.patches.back().a = work.local[pair.key.a];
    work.patches.back().b = work.local[pair.key.b];
    work.patchPairs.push_back(i);
    if (leans(pair, epsilon)) ++work.report.leaning;
  }
  work.report.patches = static_cast<std::uint32_t>(work.patches.size());
}

void gatherJoints(const Dynamics& dynamics, Work& work) {
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

void keepImpulses(Dynamics& dynamics, const Work& work) {
  for (std::size_t k = 0; k < work.patches.size(); ++k) {
    ContactPatch& patch = dynamics.pairs[work.patchPairs[k]].patch;
    const ContactPatch& solved = work.patches[k];
    for (std::size_t i = 0; i < patch.size; ++i) {
      patch.points[i].impulse = solved.points[i].impulse;
      patch.points[i].push = solved.points[i].push;
    }
    patch.rub = solved.rub;
    patch.twist = solved.twist;
  }
  for (std::size_t k = 0; k < work.joints.size(); ++k)
    dynamics.joints[work.jointOf[k]].impulses = work.joints[k].impulses;
}

// ---- step 3 ------------------------------------------------------------------------------------

Passage passageOf(const Solid& solid, const RigidBody& goal) {
  Passage passage = standing(solid);
  passage.toCentre = goal.centre, passage.toRotation = goal.rotation;
  passage.stands = nullptr;
  measure(passage);
  return passage;
}

/// The first `fraction` of a passage: a multiple of 2^-kMostHalvings.
Passage firstPart(Passage passage, double fraction) {
  if (fraction == 1 || passage.stands) return passage;
  Passage done = passage;
  done.toCentre = passage.fromCentre, done.toRotation = passage.fromRotation;
  for (int i = 0; i < kMostHalvings && fraction > 0; ++i) {
    const PassagePose middle = middleOf(passage);
    fraction *= 2;
    if (fraction >= 1) {
      done.toCentre = middle.centre, done.toRotation = middle.rotation;
      passage = secondHalf(passage, middle);
      fraction -= 1;
    } else {
      passage = firstHalf(passage, middle);
    }
  }
  measure(done);
  return done;
}

/// How far the pair is proved clear; 1 for one that was not separated when it set out.
double clearFraction(const Dynamics& dynamics, const NearPair& pair, Work& work) {
  if (pair.verdict != collision::Verdict::separated) return 1;
  const Solid &a = dynamics.solids[pair.key.a], &b = dynamics.solids[pair.key.b];
  const Passage& wayA = work.passages[work.local[pair.key.a]];
  const Passage& wayB = work.passages[work.local[pair.key.b]];
  if (closingOf(wayA, wayB) < apartNow(pair, a, b)) return 1;
  ++work.report.proofs;
  return clearance(shapeOf(a, pair.key.partA), wayA, shapeOf(b, pair.key.partB), wayB,
                   pair.features)
      .fraction;
}

/// Shortens the ways of the free solids of a pair. False: neither has any way left.
bool shorten(const Dynamics& dynamics, const NearPair& pair, double part, Work& work,
             std::vector<std::uint8_t>& changed) {
  bool any = false;
  for (const std::uint32_t solid : {pair.key.a, pair.key.b}) {
    const std::uint32_t i = work.local[solid];
    if (!dynamics.solids[solid].isAwake() || work.fractions[i] == 0) continue;
    work.fractions[i] *= part;
    Passage& way = work.passages[i];
    way.toCentre -= work.carried[i];
    way = firstPart(way, part);
    way.toCentre += work.carried[i];
    changed[i] = 1;
    any = true;
  }
  return any;
}

/// Who would go farther than its leash goes less far; its speed is its own.
void leash(const Solid& solid, Passage& passage) {
  for (int i = 0; i < kMostHalvings && lengthOf(passage) > solid.leash; ++i)
    passage = firstHalf(passage, middleOf(passage));
  if (lengthOf(passage) > solid.leash) passage = standing(solid);
}

/// Which of `bodies` each group of patches is carried by: the one driven body that it meets, if
/// that does not turn. kNone: none; kSeveral: it meets something else that is not free.
constexpr std::uint32_t kSeveral = kNone - 1;

std::vector<std::uint32_t> findCarriers(const Dynamics& dynamics, const Work& work,
                                        Islands& islands) {
  const auto isFree = [&](std::uint32_t body) {
    return dynamics.solids[work.solids[body]].isAwake();
  };
  for (const ContactPatch& patch : work.patches)
    if (isFree(patch.a) && isFree(patch.b)) islands.join(patch.a, patch.b);
  std::vector<std::uint32_t> carriers(work.bodies.size(), kNone);
  for (const ContactPatch& patch : work.patches) {
    if (isFree(patch.a) == isFree(patch.b)) continue;
    const std::uint32_t held = isFree(patch.a) ? patch.b : patch.a;
    std::uint32_t& carrier = carriers[islands.leaderOf(isFree(patch.a) ? patch.a : patch.b)];
    const bool carries = work.bodies[held].spin.isZero(0) && (carrier == kNone || carrier == held);
    carrier = carries ? held : kSeveral;
  }
  return carriers;
}

void findCarried(const Dynamics& dynamics, double seconds, Work& work) {
  Islands islands(work.bodies.size());
  const std::vector<std::uint32_t> carriers = findCarriers(dynamics, work, islands);
  work.carried.assign(work.bodies.size(), Vec3::Zero());
  for (std::uint32_t i = 0; i < work.bodies.size(); ++i) {
    const std::uint32_t carrier = carriers[islands.leaderOf(i)];
    if (!dynamics.solids[work.solids[i]].isAwake() || carrier >= kSeveral) continue;
    const Solid& solid = dynamics.solids[work.solids[carrier]];
    if (!solid.isFree()) work.carried[i] = seconds * solid.motion.velocity;
  }
}

/// Ways of all that go; the others stand.
void findPassages(const Dynamics& dynamics, Work& work) {
  for (std::size_t i = 0; i < work.bodies.size(); ++i) {
    const Solid& solid = dynamics.solids[work.solids[i]];
    const bool goes = solid.isAwake() || (!solid.isFree() && solid.fastest() > 0);
    work.passages.push_back(goes ? passageOf(solid, work.bodies[i]) : standing(solid));
    if (solid.isAwake()) leash(solid, work.passages.back());
  }
}

void provePassages(const Dynamics& dynamics, double seconds, Work& work) {
  work.fractions.assign(work.bodies.size(), 1);
  findCarried(dynamics, seconds, work);
  findPassages(dynamics, work);
  std::vector<std::uint8_t> open(work.bodies.size(), 1), changed(work.bodies.size(), 0);
  // Each round but the last shortens a way, after kPartialRounds to nothing.
  const std::size_t bound = work.bodies.size() + kPartialRounds + 1;
  bool any = true;
  for (std::size_t round = 0; round < bound && any; ++round) {
    any = false;
    for (const std::uint32_t i : work.active) {
      const NearPair& pair = dynamics.pairs[i];
      if (!open[work.local[pair.key.a]] && !open[work.local[pair.key.b]]) continue;
      const double part = clearFraction(dynamics, pair, work);
      if (part == 1) continue;
      if (shorten(dynamics, pair, round < kPartialRounds ? part : 0, work, changed)) {
        any = true;
      } else {
        ++work.report.squeezed;
      }
    }
    open.swap(changed);
    changed.assign(work.bodies.size(), 0);
  }
}

void setOut(Dynamics& dynamics, double seconds, Work& work) {
  for (std::size_t i = 0; i < work.bodies.size(); ++i) {
    Solid& solid = dynamics.solids[work.solids[i]];
    const bool isAwake = solid.isAwake();
    if (!isAwake && (solid.isFree() || solid.fastest() == 0)) continue;
    const Passage& way = work.passages[i];
    solid.motion.centre = way.toCentre, solid.motion.rotation = way.toRotation;
    if (isAwake) {
      const Vec3 with = work.carried[i] / seconds;
      solid.motion.velocity = with + work.fractions[i] * (work.bodies[i].velocity - with);
      solid.motion.spin = work.fractions[i] * work.bodies[i].spin;
      if (work.fractions[i] < 1) ++work.report.shortened;
    }
    solid.odometer += lengthOf(way);
    placeSolid(solid);
  }
  for (const std::uint32_t i : work.active) {
    NearPair& pair = dynamics.pairs[i];
    pair.apart -=
        closingOf(work.passages[work.local[pair.key.a]], work.passages[work.local[pair.key.b]]);
  }
}

// ---- step 4 ------------------------------------------------------------------------------------

Islands findIslands(const Dynamics& dynamics, double epsilon, const Work& work) {
  Islands islands(dynamics.solids.size());
  for (const std::uint32_t i : work.active) {
    const NearPair& pair = dynamics.pairs[i];
    if (!dynamics.solids[pair.key.a].isAwake() || !dynamics.solids[pair.key.b].isAwake()) continue;
    if (leans(pair, epsilon)) islands.join(pair.key.a, pair.key.b);
  }
  for (const Joint& joint : dynamics.joints)
    if (dynamics.solids[joint.a].isAwake() && dynamics.solids[joint.b].isAwake())
      islands.join(joint.a, joint.b);
  return islands;
}

std::vector<std::uint8_t> whoLeansOnRestless(const Dynamics& dynamics, const DynamicsStep& settings,
                                             const Work& work) {
  std::vector<std::uint8_t> restless(dynamics.solids.size(), 0);
  for (const std::uint32_t i : work.active) {
    const NearPair& pair = dynamics.pairs[i];
    const bool a = dynamics.solids[pair.key.a].restless, b = dynamics.solids[pair.key.b].restless;
    if ((!a && !b) || !leans(pair, settings.solver.epsilon)) continue;
    restless[a ? pair.key.b : pair.key.a] = 1;
  }
  return restless;
}

void rest(Dynamics& dynamics, const DynamicsStep& settings, Work& work) {
  Islands islands = findIslands(dynamics, settings.solver.epsilon, work);
  const std::vector<std::uint8_t> restless = whoLeansOnRestless(dynamics, settings, work);
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

void setPairs(Dynamics& dynamics, std::span<const PartPairKey> candidates) {
  std::vector<NearPair> pairs(candidates.size());
  auto old = dynamics.pairs.begin();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    while (old != dynamics.pairs.end() && old->key < candidates[i]) ++old;
    if (old != dynamics.pairs.end() && old->key == candidates[i]) {
      pairs[i] = std::move(*old);
    } else {
      pairs[i].key = candidates[i];
    }
  }
  dynamics.pairs = std::move(pairs);
}

DynamicsReport step(Dynamics& dynamics, const DynamicsStep& settings) {
  Work work;
  findPatches(dynamics, nearStep(settings), work);
  gatherBodies(dynamics, work);
  gatherPatches(dynamics, settings.solver.epsilon, work);
  gatherJoints(dynamics, work);
  solve(work.bodies, work.patches, work.joints, settings.solver);
  keepImpulses(dynamics, work);
  provePassages(dynamics, settings.solver.seconds, work);
  setOut(dynamics, settings.solver.seconds, work);
  rest(dynamics, settings, work);
  return work.report;
}

void forgetPairsOf(Dynamics& dynamics, std::uint32_t solid) {
  std::erase_if(dynamics.pairs,
                [&](const NearPair& pair) { return pair.key.a == solid || pair.key.b == solid; });
}

}  // namespace enfilade::scene
