// How far each body goes towards where the solver has it: step 3 at the head of dynamics.cpp.
#include <algorithm>
#include <utility>

#include "scene/physics/disjoint_sets.hpp"
#include "scene/physics/step_scratch.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kBodyBlock = 32;   // bodies that a thread takes at a time
constexpr std::size_t kScanBlock = 512;  // pairs, where each costs next to nothing
constexpr double kMore = 1 + 0x1p-40;    // above what a few roundings lose
constexpr double kAtRest = 0.5;          // of epsilon: nearer than that nothing comes to rest
constexpr double kPart = 0.25;           // of epsilon, a step: who is parted is calm (RestLimits)
constexpr int kPartialRounds = 4;        // then who is in the way does not go its way at all

Passage passageOf(const Solid& solid, const RigidBody& goal) {
  Passage passage = standing(solid);
  passage.toCentre = goal.centre, passage.toRotation = goal.rotation;
  passage.stands = nullptr;
  measure(passage);
  return passage;
}

/// How far the pair, which was `apart` when it set out, is proved clear; 1 for one that was not
/// separated. `proof`: set where the narrow phase had to be asked.
double clearFraction(const Dynamics& dynamics, const NearPair& pair, double apart,
                     const StepWork& work, std::uint8_t& proof) {
  if (pair.verdict != collision::Verdict::separated) return 1;
  const Solid &a = dynamics.solids[pair.key.a], &b = dynamics.solids[pair.key.b];
  const Passage& wayA = work.passages[work.local[pair.key.a]];
  const Passage& wayB = work.passages[work.local[pair.key.b]];
  const PartShape partA = shapeOf(a, pair.key.partA), partB = shapeOf(b, pair.key.partB);
  const double along = pair.axis.isZero(0) ? -1 : clearAlong(partA, wayA, partB, wayB, pair.axis);
  if (along == 1) return 1;
  proof = 1;
  // Where they end in one another, the plane that parted them is as good as any.
  if (along >= 0 && !separatedAtEnd(partA, wayA, partB, wayB, pair.features())) return along;
  return clearance(partA, wayA, partB, wayB, pair.features(), apart).fraction;
}

/// Who would go farther than its leash goes less far; its speed is its own.
void leash(const Solid& solid, Passage& passage) {
  for (int i = 0; i < kMostHalvings && lengthOf(passage) > solid.leash; ++i)
    passage = firstHalf(passage, middleOf(passage));
  if (lengthOf(passage) > solid.leash) passage = standing(solid);
}

/// Which of `bodies` each group of patches is carried by: the one driven body that it meets.
/// kNoPlace: none; kSeveral: more than one. What stands besides may stop it (see drop()).
constexpr std::uint32_t kSeveral = kNoPlace - 1;

std::vector<std::uint32_t> findCarriers(const Dynamics& dynamics, const StepWork& work,
                                        Islands& islands) {
  const auto solidOf = [&](std::uint32_t body) -> const Solid& {
    return dynamics.solids[work.solids[body]];
  };
  const auto holds = [&](const ContactPatch& patch) {
    return work.letOut[patch.a] == 0 && work.letOut[patch.b] == 0;
  };
  for (const ContactPatch& patch : work.patches)
    if (holds(patch) && solidOf(patch.a).isAwake() && solidOf(patch.b).isAwake())
      islands.join(patch.a, patch.b);
  std::vector<std::uint32_t> carriers(work.bodies.size(), kNoPlace);
  for (const ContactPatch& patch : work.patches) {
    const bool firstIsFree = solidOf(patch.a).isAwake();
    if (!holds(patch) || firstIsFree == solidOf(patch.b).isAwake()) continue;
    const std::uint32_t held = firstIsFree ? patch.b : patch.a;
    if (work.passages[held].stands) continue;
    std::uint32_t& carrier = carriers[islands.leaderOf(firstIsFree ? patch.a : patch.b)];
    carrier = carrier == kNoPlace || carrier == held ? held : kSeveral;
  }
  return carriers;
}

Carry carryBy(std::uint32_t carrier, double seconds, const StepWork& work) {
  const Passage& way = work.passages[carrier];
  Carry carry;
  carry.by = carrier;
  carry.pivot = way.fromCentre;
  carry.shift = way.toCentre - way.fromCentre;
  carry.turn = way.toRotation * way.fromRotation.conjugate();
  carry.turns = way.turn > 0;
  carry.velocity = carry.shift / seconds;
  carry.spin = work.bodies[carrier].spin;
  return carry;
}

void findCarried(const Dynamics& dynamics, double seconds, StepWork& work) {
  Islands islands(work.bodies.size());
  const std::vector<std::uint32_t> carriers = findCarriers(dynamics, work, islands);
  work.carried.assign(work.bodies.size(), {});
  for (std::uint32_t i = 0; i < work.bodies.size(); ++i) {
    const std::uint32_t carrier = carriers[islands.leaderOf(i)];
    if (!dynamics.solids[work.solids[i]].isAwake() || carrier >= kSeveral) continue;
    if (!dynamics.solids[work.solids[carrier]].isFree())
      work.carried[i] = carryBy(carrier, seconds, work);
  }
}

/// Ways of all that go; the others stand.
void findPassages(const Dynamics& dynamics, StepWork& work) {
  work.passages.resize(work.bodies.size());
  work.workers->share(work.bodies.size(), kBodyBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      const Solid& solid = dynamics.solids[work.solids[i]];
      const bool goes = solid.isAwake() || solid.isDriven();
      work.passages[i] = goes ? passageOf(solid, work.bodies[i]) : standing(solid);
      if (solid.isAwake()) leash(solid, work.passages[i]);
    }
  });
}

/// Where each body would go that can go nothing of its way: out of what it is too near to, half of
/// what lacks where the other gives way as well. Without it a heap that is shaken comes to stand:
/// the nearer two are, the less of any way of theirs is proved, and each that stands holds up all
/// that are near to it.
void findPartings(const Dynamics& dynamics, double epsilon, StepWork& work) {
  const double rests = kAtRest * epsilon;
  work.partings.assign(work.bodies.size(), Vec3::Zero());
  for (const std::uint32_t i : work.patched) {
    const NearPair& pair = dynamics.pairs[i];
    const Solid &a = dynamics.solids[pair.key.a], &b = dynamics.solids[pair.key.b];
    const double apart = apartNow(pair, a, b);
    if (pair.verdict != collision::Verdict::separated || !(apart < rests)) continue;
    const double share = a.isAwake() && b.isAwake() ? 0.5 : 1;
    const Vec3 parting = share * (rests - std::max(0.0, apart)) * pair.patch()->normal;
    work.partings[work.local[pair.key.a]] -= parting;
    work.partings[work.local[pair.key.b]] += parting;
  }
  for (Vec3& parting : work.partings)
    if (const double length = parting.norm(); length > kPart * epsilon)
      parting *= kPart * epsilon / length;
}

/// What the rounds of proofs find. Most pairs are far from one another, and there are many: they
/// are passed over by how far their bodies go beside a motion that is the same for all.
struct Round {
  std::vector<std::uint8_t> open;  ///< of each of `bodies`: its way is new
  std::vector<double> least;       ///< of each of `bodies`, of the parts of its pairs
  Vec3 shift = Vec3::Zero();       ///< about how all go
  std::vector<double> widths;      ///< of each of `bodies`: metres, of its longest beside `shift`
  std::vector<double> jumped;      ///< of each of `bodies`: Solid's
  /// Those of `active` that may meet, and how far they are apart at the start.
  std::vector<std::uint32_t> near;
  std::vector<double> apart;
  std::vector<std::uint8_t> isNear;  ///< of each of `active`
  std::vector<double> parts;         ///< of each of `near`: of the ways as they are, proved
  std::vector<std::uint8_t> proofs;  ///< of each of `near`: the narrow phase was asked
  /// Solids of which neither could be kept from the other.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> squeezed;
};

void startRounds(const Dynamics& dynamics, const StepWork& work, Round& round) {
  round.open.assign(work.bodies.size(), 1);
  round.widths.assign(work.bodies.size(), -1);
  round.jumped.clear(), round.near.clear(), round.apart.clear(), round.squeezed.clear();
  for (const std::uint32_t solid : work.solids)
    round.jumped.push_back(dynamics.solids[solid].jumped);
  round.shift = Vec3::Zero();
  for (std::uint32_t i = 0; i < work.report.awake; ++i)  // they are the first
    round.shift += work.passages[i].toCentre - work.passages[i].fromCentre;
  if (work.report.awake > 0) round.shift /= work.report.awake;
}

/// Takes new ways into account. Returns whether any body's is wider than it ever was.
bool widen(StepWork& work, Round& round) {
  bool any = false;
  for (std::size_t i = 0; i < work.bodies.size(); ++i) {
    if (round.open[i] == 0) continue;
    const Stride& stride = work.strides[i] = strideOf(work.passages[i]);
    const double width = (stride.way - round.shift).norm() + stride.tip;
    if (width <= round.widths[i]) continue;
    // Shortened, it goes on more and more as its carrier does.
    const double carried = (work.carried[i].shift - round.shift).norm() + stride.tip;
    round.widths[i] = std::max(width, carried) * kMore;  // no number: nothing is clear of it
    any = true;
  }
  return any;
}

void findNear(const Dynamics& dynamics, StepWork& work, Round& round) {
  round.isNear.resize(work.active.size());
  const auto apartOf = [&](std::size_t k) {
    const auto [a, b] = work.bodiesOf[k];
    return apartNow(dynamics.pairs[work.active[k]], round.jumped[a] + round.jumped[b]);
  };
  work.workers->share(work.active.size(), kScanBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) {
      const auto [a, b] = work.bodiesOf[k];
      round.isNear[k] = !((round.widths[a] + round.widths[b]) * kMore < apartOf(k));
    }
  });
  round.near.clear(), round.apart.clear();
  for (std::uint32_t k = 0; k < work.active.size(); ++k) {
    if (round.isNear[k] == 0) continue;
    round.near.push_back(k);
    round.apart.push_back(apartOf(k));
  }
}

void proveRound(const Dynamics& dynamics, StepWork& work, Round& round) {
  if (widen(work, round)) findNear(dynamics, work, round);
  round.parts.assign(round.near.size(), 1);
  round.proofs.assign(round.near.size(), 0);
  work.workers->share(round.near.size(), kPairBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t n = from; n < to; ++n) {
      const std::uint32_t k = round.near[n];
      const auto [a, b] = work.bodiesOf[k];
      if (round.open[a] == 0 && round.open[b] == 0) continue;
      if (closingOf(work.strides[a], work.strides[b]) < round.apart[n]) continue;
      const NearPair& pair = dynamics.pairs[work.active[k]];
      round.parts[n] = clearFraction(dynamics, pair, round.apart[n], work, round.proofs[n]);
    }
  });
  for (const std::uint8_t proof : round.proofs) work.report.proofs += proof;
}

/// Shortens the way of one of `bodies` to a part of what it is beside its carrier's.
void shorten(std::uint32_t body, double part, StepWork& work) {
  work.fractions[body] *= part;
  Passage& way = work.passages[body];
  const Carry& carry = work.carried[body];
  if (carry.by != kNoPlace) way.stands = nullptr;
  way.toCentre -= carry.shift;
  if (carry.turns) {
    way.toCentre = carry.turn.conjugate() * (way.toCentre - carry.pivot) + carry.pivot;
    way.toRotation = carry.turn.conjugate() * way.toRotation;
  }
  measure(way);
  way = firstPart(way, part);
  if (carry.turns) {
    way.toCentre = carry.turn * (way.toCentre - carry.pivot) + carry.pivot;
    way.toRotation = (carry.turn * way.toRotation).normalized();
  }
  way.toCentre += carry.shift;
  measure(way);
}

/// What its carrier would take it through stops it: nothing is penetrated that stands, rather the
/// driven body penetrates what it drives.
void drop(const Dynamics& dynamics, std::uint32_t body, StepWork& work) {
  work.fractions[body] = 0, work.yields[body] = 0;
  work.carried[body] = {};
  work.passages[body] = standing(dynamics.solids[work.solids[body]]);
}

/// Whether one of `bodies` has any way of its own left.
bool canYield(const Dynamics& dynamics, std::uint32_t body, const StepWork& work) {
  return dynamics.solids[work.solids[body]].isAwake() && work.yields[body] != 0;
}

/// Whether it only goes where its carrier takes it, and `other` neither carries it nor goes along.
bool isTakenInto(std::uint32_t body, std::uint32_t other, const StepWork& work) {
  const std::uint32_t carrier = work.carried[body].by;
  return carrier != kNoPlace && carrier != other && work.carried[other].by != carrier;
}

/// Who can go nothing of its way goes out of what is too near, once. Returns whether it does.
bool goOut(std::uint32_t body, double leash, StepWork& work) {
  const Vec3 parting = std::exchange(work.partings[body], Vec3::Zero());
  Passage way = work.passages[body];
  way.toCentre += parting;
  way.stands = nullptr;
  measure(way);
  if (parting.isZero(0) || lengthOf(way) > leash) return false;
  work.passages[body] = way;
  return true;
}

/// Its way becomes a part of what it was; one that had none left loses its carrier.
void giveWay(const Dynamics& dynamics, std::uint32_t body, double part, StepWork& work) {
  const bool goesOn = work.yields[body] != 0;
  const double leash = dynamics.solids[work.solids[body]].leash;
  if (goesOn) shorten(body, part, work);
  if (goesOn && part == 0) work.yields[body] = goOut(body, leash, work);
  if (!goesOn || lengthOf(work.passages[body]) > leash) drop(dynamics, body, work);
}

/// Shortens the ways of all whose pairs are not proved clear. Returns whether any was.
bool shortenAll(const Dynamics& dynamics, bool toNothing, StepWork& work, Round& round) {
  round.least.assign(work.bodies.size(), 1);
  for (std::size_t n = 0; n < round.near.size(); ++n) {
    if (round.parts[n] == 1) continue;
    const auto [a, b] = work.bodiesOf[round.near[n]];
    bool yieldsA = canYield(dynamics, a, work), yieldsB = canYield(dynamics, b, work);
    if (!yieldsA && !yieldsB) {
      yieldsA = isTakenInto(a, b, work);
      yieldsB = isTakenInto(b, a, work);
    }
    const double part = toNothing ? 0 : round.parts[n];
    if (yieldsA) round.least[a] = std::min(round.least[a], part);
    if (yieldsB) round.least[b] = std::min(round.least[b], part);
    if (!yieldsA && !yieldsB) round.squeezed.emplace_back(work.solids[a], work.solids[b]);
  }
  work.workers->share(work.bodies.size(), kBodyBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      round.open[i] = round.least[i] < 1;
      if (round.open[i]) giveWay(dynamics, static_cast<std::uint32_t>(i), round.least[i], work);
    }
  });
  return std::ranges::find(round.open, 1) != round.open.end();
}

}  // namespace

void proveWays(const Dynamics& dynamics, double seconds, double epsilon, StepWork& work) {
  work.fractions.assign(work.bodies.size(), 1);
  work.yields.assign(work.bodies.size(), 1);
  work.strides.resize(work.bodies.size());
  findPassages(dynamics, work);
  findCarried(dynamics, seconds, work);
  thread_local Round kept;  // as StepWork
  Round& round = kept;
  findPartings(dynamics, epsilon, work);
  startRounds(dynamics, work, round);
  // Each round but the last shortens a way, after kPartialRounds to nothing, parts a body that has
  // none left, or drops one.
  const std::size_t bound = 3 * work.bodies.size() + kPartialRounds + 1;
  bool any = true;
  for (std::size_t i = 0; i < bound && any; ++i) {
    proveRound(dynamics, work, round);
    any = shortenAll(dynamics, i >= kPartialRounds, work, round);
  }
  std::sort(round.squeezed.begin(), round.squeezed.end());
  const auto end = std::unique(round.squeezed.begin(), round.squeezed.end());
  work.report.squeezed = static_cast<std::uint32_t>(end - round.squeezed.begin());
}

}  // namespace enfilade::scene
