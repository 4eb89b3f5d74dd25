// Steps
//  1. Odometer. What a verdict rests on is a margin: a distance kept by a plane, or a ball inside
//     of the body around a point of the triangle. No point of the body moves by more than
//     |dt| + |dR| r between two poses, so the verdict holds, exactly, until the odometer has used
//     up its margin. The same for the horizon: triangles that were farther than it when the tree
//     was last descended need not be looked at while it lasts. (The idea is the seed's time to
//     contact, 5.1, measured in way instead of time, so that nothing is assumed of the motion.)
//  2. Candidates, the triangles inside of the horizon, go from query to query with their features.
//     When a margin is used up (contacts), or cannot exclude that the triangle is the nearest, a
//     new one is looked for: along the last axis, or the normal of the triangle or the way between
//     the centres where there is no last axis; for what was penetrated, inside of the body
//     (hull_planes). Where that fails, decide() is asked, started from the last features.
//  3. Gathering. When the horizon is used up, the tree is descended depth first, nearer child
//  first,
//     bounded by the nearest known triangle and a lookahead of some steps of the body. Lower bounds
//     of the distance to a box: from the body's box, from its ball, and from the plane of the last
//     closest points (mesh_probe).
// Departure from the usual best-first search with a queue: with the last nearest triangle as the
// first bound, the queue costs more than the few boxes that it saves.
#include "collision/compound/mesh_query.hpp"

#include <algorithm>
#include <cmath>

#include "collision/compound/query_bounds.hpp"
#include "collision/narrow_phase/refine.hpp"

namespace enfilade::collision {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kUnit = 0x1p-53;
constexpr double kMostWay = 64;  // horizons on the odometer until it is set back to 0

// How far to look ahead: so many steps, but not farther than part of the body's radius. The longer,
// the rarer is gathering and the longer are the lists; measured on 50,880 triangles.
constexpr double kLookaheadSteps = 8;
constexpr double kLookaheadRadii = 0.25;
constexpr std::size_t kMostCandidates = 256;  // beyond, the farthest are left to the next gather

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

std::optional<std::size_t> indexOf(const std::vector<Candidate>& list, std::uint32_t triangle) {
  const auto at = std::lower_bound(
      list.begin(), list.end(), triangle,
      [](const Candidate& candidate, std::uint32_t i) { return candidate.triangle < i; });
  if (at == list.end() || at->triangle != triangle) return std::nullopt;
  return static_cast<std::size_t>(at - list.begin());
}

/// Of the last closest points; zero where there are none.
Vec3 lastAxis(const MeshCache& cache) {
  const auto at = indexOf(cache.candidates, cache.nearest);
  return at ? cache.candidates[*at].features.axis : Vec3(Vec3::Zero());
}

// ---- one query ---------------------------------------------------------------------------------

struct Query {
  const ConvexBody& body;
  const TriangleTree& mesh;
  MeshCache& cache;
  double lookahead;
  bool probed = false;

  Query(const ConvexBody& asked, const TriangleTree& against, MeshCache& kept)
      : body(asked), mesh(against), cache(kept) {
    track(body, cache);
    const double most = kLookaheadRadii * cache.radius;
    lookahead = 2 * cache.step > most ? 0 : std::min(kLookaheadSteps * cache.step, most);
  }

  const Triangle& triangle(const Candidate& candidate) const {
    return mesh.triangles()[candidate.triangle];
  }
  Triangle inTree(std::uint32_t i) const {
    const Triangle& t = mesh.triangles()[i];
    const Vec3& origin = mesh.boxes().origin;
    return {t[0] - origin, t[1] - origin, t[2] - origin};
  }
  /// Placed when first needed: most queries of a body that hardly moves do without.
  const MeshProbe& probe() {
    if (!probed) placeProbe(body, cache.radius, mesh.boxes(), lastAxis(cache), cache.probe);
    probed = true;
    return cache.probe;
  }
};

// ---- deciding one triangle ---------------------------------------------------------------------

void settle(const Query& query, Candidate& candidate, Verdict verdict, double margin) {
  candidate.decided = true;
  candidate.verdict = verdict;
  candidate.margin = margin;
  candidate.since = query.cache.odometer;
}

/// A lower bound of the distance, by what is known.
double knownDistance(const MeshCache& cache, const Candidate& candidate) {
  return candidate.verdict == Verdict::separated ? std::max(0.0, wayLeft(cache, candidate)) : 0;
}

/// Whether a plane proves a distance above `wanted`; then it is known.
bool provedFarther(Query& query, Candidate& candidate, double wanted) {
  const Triangle triangle = query.inTree(candidate.triangle);
  const MeshProbe& probe = query.probe();
  const auto proves = [&](const Vec3& axis) {
    const double lower = lowerBoundAlong(probe, axis, triangle);
    if (!(lower > wanted)) return false;
    settle(query, candidate, Verdict::separated, lower);
    return true;
  };
  FeatureCache& features = candidate.features;
  if (!features.axis.isZero(0)) return proves(features.axis);
  const Vec3 between = (triangle[0] + triangle[1] + triangle[2]) / 3 - probe.centre;
  Vec3 normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  if (normal.dot(between) < 0) normal = -normal;
  features.axis = normal;
  if (proves(normal)) return true;
  if (proves(between)) {
    features.axis = between;
    return true;
  }
  return false;
}

double marginInside(Query& query, const Candidate& candidate) {
  if (!query.body.hull) return 0;
  HullPlanes& planes = query.cache.planes;
  if (!planes.made) planes = HullPlanes(*query.body.hull);
  return clearanceInside(planes, query.body, query.triangle(candidate));
}

/// decideWithin(), and what it tells for later.
std::optional<Decision> decideCandidate(Query& query, Candidate& candidate, double limit) {
  const ConvexBody triangle{std::span<const Vec3>(query.triangle(candidate))};
  const auto decision = decideWithin(query.body, triangle, limit, candidate.features);
  ++query.cache.decisions;
  if (!decision) {
    settle(query, candidate, Verdict::separated, limit);
  } else if (decision->verdict == Verdict::separated) {
    settle(query, candidate, Verdict::separated,
           std::max(0.0, decision->distance - decision->errorBound));
  } else {
    const bool inside = decision->verdict == Verdict::penetrating;
    settle(query, candidate, decision->verdict, inside ? marginInside(query, candidate) : 0);
  }
  return decision;
}

/// Makes the candidate's verdict hold, without its distance.
void decideVerdict(Query& query, Candidate& candidate) {
  if (holds(query.cache, candidate)) return;
  if (candidate.verdict != Verdict::separated) {
    const double margin = marginInside(query, candidate);
    if (margin > 0) return settle(query, candidate, Verdict::penetrating, margin);
  }
  const bool fresh = candidate.features.axis.isZero(0);
  if (provedFarther(query, candidate, 0)) return;
  if (fresh) {
    const double margin = marginInside(query, candidate);
    if (margin > 0) return settle(query, candidate, Verdict::penetrating, margin);
  }
  decideCandidate(query, candidate, query.lookahead);
}

/// The nearest triangle so far; `best` bounds the least distance from above.
struct Nearest {
  double best;
  std::optional<NearestTriangle> found{};

  bool done() const { return found && found->decision.distance == 0; }
};

/// Decides the candidate if it may be nearer than what was found.
void decideIfNearer(Query& query, Candidate& candidate, Nearest& nearest) {
  auto& found = nearest.found;
  if (nearest.done() || (found && found->triangle == candidate.triangle)) return;
  if (knownDistance(query.cache, candidate) > nearest.best) return;
  if (found && provedFarther(query, candidate, nearest.best)) return;
  const auto decision = decideCandidate(query, candidate, nearest.best + query.lookahead);
  if (!decision || decision->distance - decision->errorBound > nearest.best) return;
  if (found && !(decision->distance < found->decision.distance)) return;
  found = NearestTriangle{candidate.triangle, *decision};
  nearest.best = std::min(nearest.best, decision->distance + decision->errorBound);
}

// ---- gathering ---------------------------------------------------------------------------------

/// Everything not farther than best + lookahead is wanted; in a search for the nearest, `best`
/// shrinks on the way.
struct Gather {
  Query& query;
  Nearest nearest;
  bool wantsNearest;
  std::vector<Candidate> old{};  ///< ascending in `triangle`

  double reach() const { return nearest.best + query.lookahead; }
};

/// Last query's candidate of this triangle, or a new one.
Candidate candidateOf(const Gather& gather, std::uint32_t triangle) {
  if (const auto at = indexOf(gather.old, triangle)) return gather.old[*at];
  Candidate fresh;
  fresh.triangle = triangle;
  return fresh;
}

/// Puts the triangle on the list if it is near enough, and in a search for the nearest decides it
/// where it may be that.
void consider(Gather& gather, std::uint32_t triangle) {
  MeshCache& cache = gather.query.cache;
  const double lower = lowerBound(gather.query.probe(), gather.query.inTree(triangle));
  if (lower > gather.reach()) {
    cache.horizon = std::min(cache.horizon, lower);
    return;
  }
  Candidate candidate = candidateOf(gather, triangle);
  if (lower > knownDistance(cache, candidate))
    settle(gather.query, candidate, Verdict::separated, lower);
  if (gather.wantsNearest) decideIfNearer(gather.query, candidate, gather.nearest);
  cache.candidates.push_back(candidate);
}

/// Descends the tree; what is passed over lies beyond the horizon.
void descend(Gather& gather) {
  struct Open {
    const BoxTree::Branch* branch;
    double lower;
  };
  const BoxTree& tree = gather.query.mesh.boxes();
  const MeshProbe& probe = gather.query.probe();
  MeshCache& cache = gather.query.cache;
  std::array<Open, kTreeDepthBound> stack;
  std::size_t depth = 0;
  stack[depth++] = {&tree.root, lowerBound(probe, tree.root.box)};
  while (depth > 0) {  // each branch once
    const Open open = stack[--depth];
    if (open.lower > gather.reach()) {
      cache.horizon = std::min(cache.horizon, open.lower);
      continue;
    }
    const BoxTree::Branch& branch = *open.branch;
    for (std::uint32_t i = branch.first; i < branch.first + branch.count; ++i) consider(gather, i);
    if (branch.isLeaf()) continue;
    const auto& children = tree.nodes[branch.first].children;
    const Open left{&children[0], lowerBound(probe, children[0].box)};
    const Open right{&children[1], lowerBound(probe, children[1].box)};
    const bool leftFirst = left.lower <= right.lower;
    stack[depth++] = leftFirst ? right : left;
    stack[depth++] = leftFirst ? left : right;
  }
}

/// Drops candidates beyond the final reach, and the farthest of too many; the horizon follows.
void trim(const Gather& gather) {
  MeshCache& cache = gather.query.cache;
  auto& list = cache.candidates;
  double reach = gather.reach();
  if (list.size() > kMostCandidates) {
    std::vector<double> lower;
    for (const Candidate& candidate : list) lower.push_back(knownDistance(cache, candidate));
    std::nth_element(lower.begin(), lower.begin() + kMostCandidates, lower.end());
    reach = std::max(gather.nearest.best, std::min(reach, lower[kMostCandidates]));
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

/// Makes a new list of candidates: all triangles not farther than the gather's reach, and some.
void gatherCandidates(Gather& gather) {
  MeshCache& cache = gather.query.cache;
  ++cache.gathers;
  gather.query.probe();  // with the axis of the old list
  resetOdometer(cache);
  cache.horizon = kInfinite;
  gather.old.swap(cache.candidates);
  if (!gather.query.mesh.triangles().empty()) descend(gather);
  trim(gather);
}

}  // namespace

std::optional<NearestTriangle> nearestTriangle(const ConvexBody& body, const TriangleTree& mesh,
                                               MeshCache& cache, double limit) {
  Query query(body, mesh, cache);
  Nearest nearest{limit};
  if (seesAsFarAs(cache, 0)) {
    if (const auto last = indexOf(cache.candidates, cache.nearest))
      decideIfNearer(query, cache.candidates[*last], nearest);
    for (Candidate& candidate : cache.candidates) decideIfNearer(query, candidate, nearest);
  }
  if (!nearest.done() && !seesAsFarAs(cache, nearest.best)) {
    Gather gather{query, nearest, true};
    gatherCandidates(gather);
    nearest = gather.nearest;
  }
  if (nearest.found) cache.nearest = nearest.found->triangle;
  return nearest.found;
}

void findContacts(const ConvexBody& body, const TriangleTree& mesh, MeshCache& cache,
                  MeshContacts& contacts) {
  contacts.penetrated.clear();
  contacts.touched.clear();
  Query query(body, mesh, cache);
  if (cache.odometer < cache.quietUntil) return;
  if (!seesAsFarAs(cache, 0)) {
    Gather gather{query, {0}, false};
    gatherCandidates(gather);
  }
  double quiet = cache.horizon;
  for (Candidate& candidate : cache.candidates) {
    decideVerdict(query, candidate);
    if (candidate.verdict == Verdict::penetrating)
      contacts.penetrated.push_back(candidate.triangle);
    if (candidate.verdict == Verdict::touching) contacts.touched.push_back(candidate.triangle);
    quiet = std::min(quiet, candidate.since + candidate.margin);
  }
  cache.quietUntil = contacts.verdict() == Verdict::separated ? quiet * (1 - 16 * kUnit) : -1;
}

bool isAnythingNearer(const ConvexBody& body, const TriangleTree& mesh, double limit,
                      MeshCache& cache) {
  Query query(body, mesh, cache);
  if (!(limit > 0)) return false;
  if (!seesAsFarAs(cache, limit)) {
    Gather gather{query, {limit}, false};
    gatherCandidates(gather);
  }
  for (Candidate& candidate : cache.candidates) {
    if (holds(cache, candidate) && candidate.verdict != Verdict::separated) return true;
    if (knownDistance(cache, candidate) >= limit || provedFarther(query, candidate, limit))
      continue;
    const auto decision = decideCandidate(query, candidate, limit + query.lookahead);
    if (!decision || decision->distance - decision->errorBound >= limit) continue;
    if (decision->distance + decision->errorBound < limit) return true;
    const ConvexBody triangle{std::span<const Vec3>(query.triangle(candidate))};
    if (isNearerThan(body, triangle, limit, candidate.features)) return true;
  }
  return false;
}

}  // namespace enfilade::collision
