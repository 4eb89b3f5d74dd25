// Steps
//  1. Odometer. What a verdict rests on is a margin: a distance kept by a plane, or a ball inside
//     of the body around a point of the triangle. No point of the body moves by more than
//     |dt| + |dR| r between two poses, so the verdict holds, exactly, until the odometer has used
//     up its margin. The same for the horizon: triangles that were farther than it when the tree
//     was last descended need not be looked at while it lasts. (The idea is the seed's time to
//     contact, 5.1, measured in way instead of time, so that nothing is assumed of the motion.)
//  2. Candidates, the triangles inside of the horizon, go from query to query with their features.
//     One is decided anew only when its margin is used up (contacts) or cannot exclude that it is
//     the nearest (distance); started from its last features, with a limit beyond which decide()
//     gives up.
//  3. Gathering. When the horizon is used up, the tree is descended depth first, nearer child
//  first,
//     bounded by the nearest known triangle and a lookahead of kLookahead steps of the body. Lower
//     bounds of the distance to a box: from the body's box, from its ball, and from the plane of
//     the last closest points.
// Departure from the usual best-first search with a queue: with the last nearest triangle as the
// first bound, the queue costs more than the few boxes that it saves.
//
// Rounding. The search works in the tree's frame: the body's vertices are turned and moved by
// t - origin. Everything there is smaller than L = extent + |t - origin| + 2r, a vertex is off by
// less than 8u L, a box, a ball or a plane's gap by less than 16u L: kPad L = 64u L is subtracted
// from each lower bound. (That weakens the search, not its answer: verdicts are decide()'s.)
#include "collision/mesh_query.hpp"

#include <algorithm>
#include <cmath>

#include "collision/refine.hpp"

namespace enfilade::collision {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kUnit = 0x1p-53;
constexpr double kPad = 64 * kUnit;            // see the file's head
constexpr double kLookahead = 8;               // steps of the body: gathers are rarer, lists longer
constexpr double kMostWay = 64;                // horizons on the odometer until it is set back to 0
constexpr std::size_t kMostCandidates = 1024;  // beyond, the farthest are left to the next gather

using Candidate = MeshCache::Candidate;

// ---- odometer ----------------------------------------------------------------------------------

double radiusOf(const ConvexBody& body) {
  double squared = 0;
  for (const Vec3& v : body.vertices) squared = std::max(squared, v.squaredNorm());
  return std::sqrt(squared) * (1 + 4 * kUnit);
}

/// How far any point of the body went since the last query, rounded up; 0 for the same pose only.
double stepTo(const MeshCache& cache, const Vec3& translation, const Mat3& rotation) {
  if (translation == cache.translation && rotation == cache.rotation) return 0;
  const double moved = (translation - cache.translation).norm();
  const double turned = (rotation - cache.rotation).norm() * cache.radius;
  return (moved + turned) * (1 + 32 * kUnit) + 0x1p-500;  // what squares may lose to underflow
}

void track(const ConvexBody& body, MeshCache& cache) {
  const Mat3 rotation = body.rotation ? *body.rotation : Mat3(Mat3::Identity());
  if (cache.radius < 0) {
    cache.radius = radiusOf(body);
  } else {
    const double step = stepTo(cache, body.translation, rotation);
    if (step > 0) cache.step = step;
    // Rounded up, so that each difference of two readings is at least the way between them.
    if (step > 0) cache.odometer = (cache.odometer + step) * (1 + 4 * kUnit);
  }
  cache.translation = body.translation;
  cache.rotation = rotation;
}

double wayLeft(const MeshCache& cache, const Candidate& candidate) {
  return candidate.margin - (cache.odometer - candidate.since) * (1 + 4 * kUnit);
}

/// Whether the verdict is still proved.
bool holds(const MeshCache& cache, const Candidate& candidate) {
  if (!candidate.decided && candidate.margin == 0) return false;
  return cache.odometer == candidate.since || wayLeft(cache, candidate) > 0;
}

/// Whether every triangle that is no candidate is farther than `distance`.
bool seesAsFarAs(const MeshCache& cache, double distance) {
  return cache.horizon >= 0 && cache.odometer <= kMostWay * cache.horizon &&
         cache.horizon - cache.odometer * (1 + 4 * kUnit) > distance;
}

// ---- deciding one triangle ---------------------------------------------------------------------

double marginInside(const ConvexBody& body, const Triangle& triangle, MeshCache& cache) {
  if (!body.hull) return 0;
  if (!cache.planes.made) cache.planes = HullPlanes(*body.hull);
  return clearanceInside(cache.planes, body, triangle);
}

/// decideWithin(), and what it tells for later.
std::optional<Decision> decideCandidate(const ConvexBody& body, const TriangleTree& mesh,
                                        double limit, MeshCache& cache, Candidate& candidate) {
  const Triangle& triangle = mesh.triangles()[candidate.triangle];
  const auto decision =
      decideWithin(body, {std::span<const Vec3>(triangle)}, limit, candidate.features);
  ++cache.decisions;
  candidate.decided = true;
  candidate.since = cache.odometer;
  candidate.verdict = decision ? decision->verdict : Verdict::separated;
  candidate.margin = 0;
  if (!decision) {
    candidate.margin = limit;
  } else if (decision->verdict == Verdict::separated) {
    candidate.margin = std::max(0.0, decision->distance - decision->errorBound);
  } else if (decision->verdict == Verdict::penetrating) {
    candidate.margin = marginInside(body, triangle, cache);
  }
  return decision;
}

/// A lower bound of the distance, by what is known.
double knownDistance(const MeshCache& cache, const Candidate& candidate) {
  return candidate.verdict == Verdict::separated ? std::max(0.0, wayLeft(cache, candidate)) : 0;
}

/// Decides the candidate if it may be nearer than `found`; `best` bounds the least distance.
void decideIfNearer(const ConvexBody& body, const TriangleTree& mesh, MeshCache& cache,
                    Candidate& candidate, double& best, std::optional<NearestTriangle>& found) {
  if (found && (found->triangle == candidate.triangle || found->decision.distance == 0)) return;
  if (knownDistance(cache, candidate) > best) return;
  const auto decision =
      decideCandidate(body, mesh, best + kLookahead * cache.step, cache, candidate);
  if (!decision || decision->distance - decision->errorBound > best) return;
  if (found && !(decision->distance < found->decision.distance)) return;
  found = NearestTriangle{candidate.triangle, *decision};
  best = std::min(best, decision->distance + decision->errorBound);
}

// ---- the search's lower bounds -----------------------------------------------------------------

/// The body in the tree's frame.
struct Probe {
  Box box;
  Vec3 centre = Vec3::Zero();
  double radius = 0;         ///< of a ball around `centre` that holds the body
  Vec3 axis = Vec3::Zero();  ///< unit or zero; the body lies below `support` along it
  double support = 0;
  double pad = 0;
};

Probe probeOf(const ConvexBody& body, const TriangleTree& mesh, const MeshCache& cache,
              const Vec3& axis) {
  thread_local std::vector<Vec3> turned;
  turned.clear();
  const Vec3 shift = body.translation - mesh.boxes().origin;
  Probe probe;
  const double length = axis.norm();
  if (length > 0 && std::isfinite(length)) probe.axis = axis / length;
  probe.support = -kInfinite;
  for (const Vec3& v : body.vertices) {
    turned.push_back((body.rotation ? Vec3(*body.rotation * v) : v) + shift);
    probe.box.include(turned.back());
    probe.support = std::max(probe.support, probe.axis.dot(turned.back()));
  }
  probe.centre = probe.box.centre();
  double squared = 0;
  for (const Vec3& v : turned) squared = std::max(squared, (v - probe.centre).squaredNorm());
  probe.radius = std::sqrt(squared);
  probe.pad = kPad * (mesh.boxes().extent + shift.cwiseAbs().sum() + 2 * cache.radius);
  return probe;
}

double boxesApart(const Probe& probe, const Vec3& min, const Vec3& max) {
  const Vec3 gap = (min - probe.box.max).cwiseMax(probe.box.min - max).cwiseMax(0.0);
  const Vec3 out = (min - probe.centre).cwiseMax(probe.centre - max).cwiseMax(0.0);
  return std::max(std::sqrt(gap.squaredNorm()), std::sqrt(out.squaredNorm()) - probe.radius);
}

double lowerBound(const Probe& probe, const NarrowBox& box) {
  const Vec3 min(box.min[0], box.min[1], box.min[2]), max(box.max[0], box.max[1], box.max[2]);
  double least = -probe.support;
  for (int i = 0; i < 3; ++i) least += probe.axis[i] * (probe.axis[i] > 0 ? min[i] : max[i]);
  return std::max(boxesApart(probe, min, max), least) - probe.pad;
}

double lowerBound(const Probe& probe, const Triangle& world, const Vec3& origin) {
  const Triangle t{world[0] - origin, world[1] - origin, world[2] - origin};
  const Box box = boxOf(t);
  const double least =
      std::min({probe.axis.dot(t[0]), probe.axis.dot(t[1]), probe.axis.dot(t[2])}) - probe.support;
  return std::max(boxesApart(probe, box.min, box.max), least) - probe.pad;
}

// ---- gathering ---------------------------------------------------------------------------------

/// What is being looked for: everything not farther than best + lookahead, and in a search for the
/// nearest, `best` shrinks on the way.
struct Gather {
  const ConvexBody& body;
  const TriangleTree& mesh;
  MeshCache& cache;
  Probe probe;
  double best;  ///< contacts: 0; nearest: an upper bound of the distance, or the limit
  double lookahead;
  bool wantsNearest;
  std::vector<Candidate> old;  ///< ascending in `triangle`
  std::optional<NearestTriangle> found{};

  double reach() const { return best + lookahead; }
};

std::optional<std::size_t> indexOf(const std::vector<Candidate>& list, std::uint32_t triangle) {
  const auto at = std::lower_bound(
      list.begin(), list.end(), triangle,
      [](const Candidate& candidate, std::uint32_t i) { return candidate.triangle < i; });
  if (at == list.end() || at->triangle != triangle) return std::nullopt;
  return static_cast<std::size_t>(at - list.begin());
}

/// Last query's candidate of this triangle, or a new one.
Candidate candidateOf(const Gather& gather, std::uint32_t triangle) {
  if (const auto at = indexOf(gather.old, triangle)) return gather.old[*at];
  Candidate fresh;
  fresh.triangle = triangle;
  fresh.features.axis = gather.probe.axis;
  return fresh;
}

/// Puts the triangle on the list if it is near enough, and in a search for the nearest decides it
/// where it may be that.
void consider(Gather& gather, std::uint32_t triangle) {
  MeshCache& cache = gather.cache;
  const double lower =
      lowerBound(gather.probe, gather.mesh.triangles()[triangle], gather.mesh.boxes().origin);
  if (lower > gather.reach()) {
    cache.horizon = std::min(cache.horizon, lower);
    return;
  }
  Candidate candidate = candidateOf(gather, triangle);
  if (lower > 0 && !(candidate.decided && wayLeft(cache, candidate) > lower)) {
    candidate.verdict = Verdict::separated;
    candidate.margin = lower;
    candidate.since = cache.odometer;
  }
  if (gather.wantsNearest && lower <= gather.best)
    decideIfNearer(gather.body, gather.mesh, cache, candidate, gather.best, gather.found);
  cache.candidates.push_back(candidate);
}

/// Descends the tree; what is passed over lies beyond the horizon.
void descend(Gather& gather) {
  struct Open {
    const BoxTree::Branch* branch;
    double lower;
  };
  const BoxTree& tree = gather.mesh.boxes();
  std::array<Open, kTreeDepthBound> stack;
  std::size_t depth = 0;
  stack[depth++] = {&tree.root, lowerBound(gather.probe, tree.root.box)};
  while (depth > 0) {  // each branch once
    const Open open = stack[--depth];
    if (open.lower > gather.reach()) {
      gather.cache.horizon = std::min(gather.cache.horizon, open.lower);
      continue;
    }
    const BoxTree::Branch& branch = *open.branch;
    for (std::uint32_t i = branch.first; i < branch.first + branch.count; ++i) consider(gather, i);
    if (branch.isLeaf()) continue;
    const auto& children = tree.nodes[branch.first].children;
    const Open left{&children[0], lowerBound(gather.probe, children[0].box)};
    const Open right{&children[1], lowerBound(gather.probe, children[1].box)};
    const bool leftFirst = left.lower <= right.lower;
    stack[depth++] = leftFirst ? right : left;
    stack[depth++] = leftFirst ? left : right;
  }
}

/// Drops candidates beyond the final reach, and the farthest of too many; the horizon follows.
void trim(const Gather& gather) {
  MeshCache& cache = gather.cache;
  auto& list = cache.candidates;
  double reach = gather.reach();
  if (list.size() > kMostCandidates) {
    std::vector<double> lower;
    for (const Candidate& candidate : list) lower.push_back(knownDistance(cache, candidate));
    std::nth_element(lower.begin(), lower.begin() + kMostCandidates, lower.end());
    reach = std::max(gather.best, std::min(reach, lower[kMostCandidates]));
  }
  std::erase_if(list, [&](const Candidate& candidate) {
    const double lower = knownDistance(cache, candidate);
    if (!(lower > reach)) return false;
    cache.horizon = std::min(cache.horizon, lower);
    return true;
  });
  std::sort(list.begin(), list.end(),
            [](const Candidate& a, const Candidate& b) { return a.triangle < b.triangle; });
}

/// All margins are measured from now on.
void resetOdometer(MeshCache& cache) {
  for (Candidate& candidate : cache.candidates) {
    candidate.margin = std::max(0.0, wayLeft(cache, candidate));
    // What was decided at this very pose stays decided; other verdicts without a margin do not.
    if (candidate.margin == 0 && candidate.since != cache.odometer) candidate.decided = false;
    candidate.since = 0;
  }
  cache.odometer = 0;
  cache.quietUntil = -1;
}

/// Makes a new list of candidates: all triangles not farther than `gather`'s reach, and some.
void gatherCandidates(Gather& gather) {
  MeshCache& cache = gather.cache;
  ++cache.gathers;
  resetOdometer(cache);
  cache.horizon = kInfinite;
  gather.old.swap(cache.candidates);
  if (!gather.mesh.triangles().empty()) descend(gather);
  trim(gather);
}

Gather gatherFor(const ConvexBody& body, const TriangleTree& mesh, MeshCache& cache, double best,
                 const Vec3& axis) {
  return {body,  mesh, cache, probeOf(body, mesh, cache, axis), best, kLookahead * cache.step,
          false, {}};
}

Vec3 lastAxis(const MeshCache& cache) {
  const auto at = indexOf(cache.candidates, cache.nearest);
  return at ? cache.candidates[*at].features.axis : Vec3(Vec3::Zero());
}

}  // namespace

std::optional<NearestTriangle> nearestTriangle(const ConvexBody& body, const TriangleTree& mesh,
                                               MeshCache& cache, double limit) {
  track(body, cache);
  double best = limit;
  std::optional<NearestTriangle> found;
  if (seesAsFarAs(cache, 0)) {
    if (const auto last = indexOf(cache.candidates, cache.nearest))
      decideIfNearer(body, mesh, cache, cache.candidates[*last], best, found);
    for (Candidate& candidate : cache.candidates)
      decideIfNearer(body, mesh, cache, candidate, best, found);
  }
  if (!seesAsFarAs(cache, found && found->decision.distance == 0 ? 0 : best)) {
    const Vec3 axis = found ? found->decision.normal : lastAxis(cache);
    Gather gather = gatherFor(body, mesh, cache, best, axis);
    gather.wantsNearest = true;
    gather.found = found;
    gatherCandidates(gather);
    found = gather.found;
  }
  if (found) cache.nearest = found->triangle;
  return found;
}

void findContacts(const ConvexBody& body, const TriangleTree& mesh, MeshCache& cache,
                  MeshContacts& contacts) {
  contacts.penetrated.clear();
  contacts.touched.clear();
  track(body, cache);
  if (cache.odometer < cache.quietUntil) return;
  if (!seesAsFarAs(cache, 0)) {
    Gather gather = gatherFor(body, mesh, cache, 0, lastAxis(cache));
    gatherCandidates(gather);
  }
  double quiet = cache.horizon;
  for (Candidate& candidate : cache.candidates) {
    if (!holds(cache, candidate))
      decideCandidate(body, mesh, kLookahead * cache.step, cache, candidate);
    if (candidate.verdict == Verdict::penetrating)
      contacts.penetrated.push_back(candidate.triangle);
    if (candidate.verdict == Verdict::touching) contacts.touched.push_back(candidate.triangle);
    quiet = std::min(quiet, candidate.since + candidate.margin * (1 - 8 * kUnit));
  }
  cache.quietUntil = contacts.verdict() == Verdict::separated ? quiet * (1 - 8 * kUnit) : -1;
}

bool isAnythingNearer(const ConvexBody& body, const TriangleTree& mesh, double limit,
                      MeshCache& cache) {
  track(body, cache);
  if (!seesAsFarAs(cache, limit)) {
    Gather gather = gatherFor(body, mesh, cache, std::max(0.0, limit), lastAxis(cache));
    gatherCandidates(gather);
  }
  for (Candidate& candidate : cache.candidates) {
    if (knownDistance(cache, candidate) >= limit) continue;
    const auto decision =
        decideCandidate(body, mesh, limit + kLookahead * cache.step, cache, candidate);
    if (!decision || decision->distance - decision->errorBound >= limit) continue;
    if (decision->distance + decision->errorBound < limit) return true;
    const Triangle& triangle = mesh.triangles()[candidate.triangle];
    if (isNearerThan(body, {std::span<const Vec3>(triangle)}, limit, candidate.features))
      return true;
  }
  return false;
}

}  // namespace enfilade::collision
