// Steps
//  1. Accumulated motion. Each verdict has a margin: a distance proved by a plane, or a ball in the
//     body around a point of the triangle. No point of the body moves by more than |dt| + |dR| r
//     between two poses, so the verdict holds exactly until the accumulated motion exceeds the
//     margin. Likewise the candidate radius: triangles that were farther at the last traversal need
//     no test until the motion exceeds it. (This is time to contact, Lin 1993, section 5.1, in
//     distance instead of time; it assumes nothing about the motion.)
//  2. Candidates are the triangles inside the candidate radius. They keep their features between
//     queries. A new margin is needed when the old one is used up (contacts), or cannot exclude
//     that the triangle is the nearest. It is sought along the last axis; without one, along the
//     triangle normal or the line between the centres. For penetrated triangles it is sought inside
//     the body (hull_planes). If that fails, computeSeparation() runs from the last features.
//  3. Broad update. When the candidate radius is used up, the tree is traversed depth first, nearer
//     child first. The nearest known triangle and a lookahead of some steps of the body bound the
//     traversal. Lower bounds of the distance to a box come from the body's box, from its bounding
//     sphere, and from the plane of the last closest points (query_bounds).
// Departure from the usual best-first search with a queue: with the last nearest triangle as the
// first bound, the queue costs more than the few boxes that it saves.
#include "collision/compound/mesh_query.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/compound/query_bounds.hpp"
#include "collision/floating_point.hpp"
#include "collision/narrow_phase/refine.hpp"

namespace enfilade::collision {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMaxMotionRadii = 64;  // accumulated motion before a reset, in candidate radii

// Lookahead: a number of steps, at most a fraction of the body's radius. A longer lookahead makes
// broad updates rarer and candidate lists longer. Chosen by measurement on 50,880 triangles.
constexpr double kLookaheadSteps = 8;
constexpr double kLookaheadRadii = 0.25;
constexpr std::size_t kMaxCandidates = 256;  // the farthest above this are dropped

using Candidate = MeshCache::Candidate;

// ---- accumulated motion ------------------------------------------------------------------------

double computeVertexRadius(const PlacedConvex& body) {
  double squared = 0;
  for (const Vec3& v : body.vertices) squared = std::max(squared, v.squaredNorm());
  return std::sqrt(squared) * (1 + 4 * kRoundoff);
}

/// Upper bound of the motion of any body point since the last query; 0 for the same pose only.
double computeStepBound(const MeshCache& cache, const Vec3& translation, const Mat3& rotation) {
  if (translation == cache.translation && rotation == cache.rotation) return 0;
  const double moved = (translation - cache.translation).norm();
  const double rotated = (rotation - cache.rotation).norm() * cache.radius;
  return (moved + rotated) * (1 + 32 * kRoundoff) + 0x1p-500;  // covers underflow of squares
}

void trackMotion(const PlacedConvex& body, MeshCache& cache) {
  const Mat3 rotation = body.rotation ? *body.rotation : Mat3(Mat3::Identity());
  if (cache.radius < 0) {
    cache.radius = computeVertexRadius(body);
  } else {
    const double step = computeStepBound(cache, body.translation, rotation);
    ENFILADE_ASSERT(!(step < 0));
    if (step > 0) cache.lastStep = step;
    // Rounded up, so that the difference of two values is at least the motion between them.
    if (step > 0) cache.accumulatedMotion = (cache.accumulatedMotion + step) * (1 + 4 * kRoundoff);
  }
  cache.translation = body.translation;
  cache.rotation = rotation;
}

double computeRemainingMargin(const MeshCache& cache, const Candidate& candidate) {
  return candidate.margin - (cache.accumulatedMotion - candidate.decidedAt) * (1 + 4 * kRoundoff);
}

/// True if the motion since the verdict is within its margin.
bool isVerdictValid(const MeshCache& cache, const Candidate& candidate) {
  if (!candidate.isDecided && candidate.margin == 0) return false;
  return cache.accumulatedMotion == candidate.decidedAt ||
         computeRemainingMargin(cache, candidate) > 0;
}

/// True if every triangle that is no candidate is farther than `distance`.
bool coversDistance(const MeshCache& cache, double distance) {
  return cache.candidateRadius >= 0 &&
         cache.accumulatedMotion <= kMaxMotionRadii * cache.candidateRadius &&
         cache.candidateRadius - cache.accumulatedMotion * (1 + 4 * kRoundoff) > distance;
}

std::optional<std::size_t> findCandidate(const std::vector<Candidate>& list,
                                         std::uint32_t triangle) {
  const auto at = std::lower_bound(
      list.begin(), list.end(), triangle,
      [](const Candidate& candidate, std::uint32_t i) { return candidate.triangle < i; });
  if (at == list.end() || at->triangle != triangle) return std::nullopt;
  return static_cast<std::size_t>(at - list.begin());
}

/// Axis of the last closest points; zero if unknown.
Vec3 findLastAxis(const MeshCache& cache) {
  const auto at = findCandidate(cache.candidates, cache.nearest);
  return at ? cache.candidates[*at].features.axis : Vec3(Vec3::Zero());
}

// ---- one query ---------------------------------------------------------------------------------

struct Query {
  const PlacedConvex& body;
  const TriangleTree& mesh;
  MeshCache& cache;
  double lookahead;
  bool boundsReady = false;

  Query(const PlacedConvex& convex, const TriangleTree& against, MeshCache& queryCache)
      : body(convex), mesh(against), cache(queryCache) {
    trackMotion(body, cache);
    const double maxLookahead = kLookaheadRadii * cache.radius;
    lookahead = 2 * cache.lastStep > maxLookahead
                    ? 0
                    : std::min(kLookaheadSteps * cache.lastStep, maxLookahead);
  }

  const Triangle& triangle(const Candidate& candidate) const {
    return mesh.triangles()[candidate.triangle];
  }
  Triangle toTreeFrame(std::uint32_t i) const {
    const Triangle& t = mesh.triangles()[i];
    const Vec3& origin = mesh.boxes().origin;
    return {t[0] - origin, t[1] - origin, t[2] - origin};
  }
  /// Computed on demand: most queries of a body that hardly moves do not need it.
  const QueryBounds& bounds() {
    if (!boundsReady)
      computeQueryBounds(body, cache.radius, mesh.boxes(), findLastAxis(cache), cache.bounds);
    boundsReady = true;
    return cache.bounds;
  }
};

// ---- verdict on one triangle -------------------------------------------------------------------

void setVerdict(const Query& query, Candidate& candidate, Verdict verdict, double margin) {
  candidate.isDecided = true;
  candidate.verdict = verdict;
  candidate.margin = margin;
  candidate.decidedAt = query.cache.accumulatedMotion;
}

/// Lower bound of the distance from the last verdict and the motion since.
double computeKnownDistance(const MeshCache& cache, const Candidate& candidate) {
  return candidate.verdict == Verdict::separated
             ? std::max(0.0, computeRemainingMargin(cache, candidate))
             : 0;
}

/// Tries to prove a distance above `wanted` with a separating plane. On success records the margin.
bool proveFarther(Query& query, Candidate& candidate, double wanted) {
  const Triangle triangle = query.toTreeFrame(candidate.triangle);
  const QueryBounds& bounds = query.bounds();
  const auto proves = [&](const Vec3& axis) {
    const double lower = computeLowerBoundAlong(bounds, axis, triangle);
    if (!(lower > wanted)) return false;
    setVerdict(query, candidate, Verdict::separated, lower);
    return true;
  };
  FeatureCache& features = candidate.features;
  if (!features.axis.isZero(0)) return proves(features.axis);
  const Vec3 between = (triangle[0] + triangle[1] + triangle[2]) / 3 - bounds.centre;
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

double computeInteriorMargin(Query& query, const Candidate& candidate) {
  if (!query.body.hull) return 0;
  HullPlanes& planes = query.cache.planes;
  if (!planes.initialized) planes = HullPlanes(*query.body.hull);
  return computeInteriorClearance(planes, query.body, query.triangle(candidate));
}

/// Runs computeSeparationWithin() and records verdict and margin.
std::optional<SeparationResult> separateCandidate(Query& query, Candidate& candidate,
                                                  double limit) {
  const PlacedConvex triangle{std::span<const Vec3>(query.triangle(candidate))};
  const auto separation = computeSeparationWithin(query.body, triangle, limit, candidate.features);
  ++query.cache.separationQueries;
  if (!separation) {
    setVerdict(query, candidate, Verdict::separated, limit);
  } else if (separation->verdict == Verdict::separated) {
    setVerdict(query, candidate, Verdict::separated,
               std::max(0.0, separation->distance - separation->errorBound));
  } else {
    const bool inside = separation->verdict == Verdict::penetrating;
    setVerdict(query, candidate, separation->verdict,
               inside ? computeInteriorMargin(query, candidate) : 0);
  }
  return separation;
}

/// Makes the verdict of the candidate valid for the current pose, without its distance.
void updateVerdict(Query& query, Candidate& candidate) {
  if (isVerdictValid(query.cache, candidate)) return;
  if (candidate.verdict != Verdict::separated) {
    const double margin = computeInteriorMargin(query, candidate);
    if (margin > 0) return setVerdict(query, candidate, Verdict::penetrating, margin);
  }
  const bool isNew = candidate.features.axis.isZero(0);
  if (proveFarther(query, candidate, 0)) return;
  if (isNew) {
    const double margin = computeInteriorMargin(query, candidate);
    if (margin > 0) return setVerdict(query, candidate, Verdict::penetrating, margin);
  }
  separateCandidate(query, candidate, query.lookahead);
}

/// Nearest triangle so far. `best` is an upper bound of the minimum distance.
struct Nearest {
  double best;
  std::optional<NearestTriangle> found{};

  bool isDone() const { return found && found->separation.distance == 0; }
};

/// Computes the distance of the candidate if it may be closer than the nearest so far.
void updateNearest(Query& query, Candidate& candidate, Nearest& nearest) {
  auto& found = nearest.found;
  if (nearest.isDone() || (found && found->triangle == candidate.triangle)) return;
  if (computeKnownDistance(query.cache, candidate) > nearest.best) return;
  if (found && proveFarther(query, candidate, nearest.best)) return;
  const auto separation = separateCandidate(query, candidate, nearest.best + query.lookahead);
  if (!separation || separation->distance - separation->errorBound > nearest.best) return;
  if (found && !(separation->distance < found->separation.distance)) return;
  found = NearestTriangle{candidate.triangle, *separation};
  nearest.best = std::min(nearest.best, separation->distance + separation->errorBound);
}

// ---- broad update ------------------------------------------------------------------------------

/// Collects all triangles up to the distance best + lookahead. In a search for the nearest
/// triangle, `best` decreases during the traversal.
struct CandidateUpdate {
  Query& query;
  Nearest nearest;
  bool wantsNearest;
  std::vector<Candidate> old{};  ///< ascending in `triangle`

  double maxDistance() const { return nearest.best + query.lookahead; }
};

/// Candidate of this triangle from the last query, or a new one.
Candidate reuseOrMakeCandidate(const CandidateUpdate& update, std::uint32_t triangle) {
  if (const auto at = findCandidate(update.old, triangle)) return update.old[*at];
  Candidate candidate;
  candidate.triangle = triangle;
  return candidate;
}

/// Adds the triangle to the candidates if it is close enough. In a search for the nearest triangle,
/// also updates the nearest.
void considerTriangle(CandidateUpdate& update, std::uint32_t triangle) {
  MeshCache& cache = update.query.cache;
  const double lower = computeLowerBound(update.query.bounds(), update.query.toTreeFrame(triangle));
  if (lower > update.maxDistance()) {
    cache.candidateRadius = std::min(cache.candidateRadius, lower);
    return;
  }
  Candidate candidate = reuseOrMakeCandidate(update, triangle);
  if (lower > computeKnownDistance(cache, candidate))
    setVerdict(update.query, candidate, Verdict::separated, lower);
  if (update.wantsNearest) updateNearest(update.query, candidate, update.nearest);
  cache.candidates.push_back(candidate);
}

/// Traverses the tree. Skipped branches reduce the candidate radius to their distance.
void descendTree(CandidateUpdate& update) {
  struct OpenBranch {
    const BoxTree::Branch* branch;
    double lower;
  };
  const BoxTree& tree = update.query.mesh.boxes();
  const QueryBounds& bounds = update.query.bounds();
  MeshCache& cache = update.query.cache;
  std::array<OpenBranch, kMaxTreeDepth> stack;
  std::size_t depth = 0;
  stack[depth++] = {&tree.root, computeLowerBound(bounds, tree.root.box)};
  while (depth > 0) {  // each branch once
    const OpenBranch open = stack[--depth];
    ENFILADE_ASSERT(depth + 2 <= stack.size());
    if (open.lower > update.maxDistance()) {
      cache.candidateRadius = std::min(cache.candidateRadius, open.lower);
      continue;
    }
    const BoxTree::Branch& branch = *open.branch;
    for (std::uint32_t i = branch.first; i < branch.first + branch.count; ++i)
      considerTriangle(update, i);
    if (branch.isLeaf()) continue;
    const auto& children = tree.nodes[branch.first].children;
    const OpenBranch left{&children[0], computeLowerBound(bounds, children[0].box)};
    const OpenBranch right{&children[1], computeLowerBound(bounds, children[1].box)};
    const bool leftFirst = left.lower <= right.lower;
    stack[depth++] = leftFirst ? right : left;
    stack[depth++] = leftFirst ? left : right;
  }
}

/// Drops candidates beyond the final distance, and the farthest above kMaxCandidates. Reduces the
/// candidate radius accordingly.
void trimCandidates(const CandidateUpdate& update) {
  MeshCache& cache = update.query.cache;
  auto& list = cache.candidates;
  double maxDistance = update.maxDistance();
  if (list.size() > kMaxCandidates) {
    std::vector<double> lower;
    for (const Candidate& candidate : list) lower.push_back(computeKnownDistance(cache, candidate));
    std::nth_element(lower.begin(), lower.begin() + kMaxCandidates, lower.end());
    maxDistance = std::max(update.nearest.best, std::min(maxDistance, lower[kMaxCandidates]));
  }
  std::erase_if(list, [&](const Candidate& candidate) {
    const double lower = computeKnownDistance(cache, candidate);
    if (!(lower > maxDistance)) return false;
    cache.candidateRadius = std::min(cache.candidateRadius, lower);
    return true;
  });
  std::sort(list.begin(), list.end(),
            [](const Candidate& a, const Candidate& b) { return a.triangle < b.triangle; });
  ENFILADE_ASSERT(std::ranges::adjacent_find(list, {}, &Candidate::triangle) == list.end());
}

/// Restarts the accumulated motion at 0 and reduces all margins by the motion so far.
void resetAccumulatedMotion(MeshCache& cache) {
  for (Candidate& candidate : cache.candidates) {
    candidate.margin = std::max(0.0, computeRemainingMargin(cache, candidate));
    // Verdicts of exactly this pose stay valid; other verdicts without a margin do not.
    if (candidate.margin == 0 && candidate.decidedAt != cache.accumulatedMotion)
      candidate.isDecided = false;
    candidate.decidedAt = 0;
  }
  cache.accumulatedMotion = 0;
  cache.separatedUntil = -1;
}

/// Replaces the candidates by all triangles within maxDistance(), and possibly some more.
void updateCandidates(CandidateUpdate& update) {
  MeshCache& cache = update.query.cache;
  ++cache.broadUpdates;
  update.query.bounds();  // needs the axis of the old list
  resetAccumulatedMotion(cache);
  cache.candidateRadius = kInfinity;
  update.old.swap(cache.candidates);
  if (!update.query.mesh.triangles().empty()) descendTree(update);
  trimCandidates(update);
}

}  // namespace

std::optional<NearestTriangle> findNearestTriangle(const PlacedConvex& body,
                                                   const TriangleTree& mesh, MeshCache& cache,
                                                   double limit) {
  Query query(body, mesh, cache);
  Nearest nearest{limit};
  if (coversDistance(cache, 0)) {
    if (const auto last = findCandidate(cache.candidates, cache.nearest))
      updateNearest(query, cache.candidates[*last], nearest);
    for (Candidate& candidate : cache.candidates) updateNearest(query, candidate, nearest);
  }
  if (!nearest.isDone() && !coversDistance(cache, nearest.best)) {
    CandidateUpdate update{query, nearest, true};
    updateCandidates(update);
    nearest = update.nearest;
  }
  if (nearest.found) cache.nearest = nearest.found->triangle;
  return nearest.found;
}

void findMeshContacts(const PlacedConvex& body, const TriangleTree& mesh, MeshCache& cache,
                      MeshContacts& contacts) {
  contacts.penetrated.clear();
  contacts.touched.clear();
  Query query(body, mesh, cache);
  if (cache.accumulatedMotion < cache.separatedUntil) return;
  if (!coversDistance(cache, 0)) {
    CandidateUpdate update{query, {0}, false};
    updateCandidates(update);
  }
  double separatedMotion = cache.candidateRadius;
  for (Candidate& candidate : cache.candidates) {
    updateVerdict(query, candidate);
    if (candidate.verdict == Verdict::penetrating)
      contacts.penetrated.push_back(candidate.triangle);
    if (candidate.verdict == Verdict::touching) contacts.touched.push_back(candidate.triangle);
    separatedMotion = std::min(separatedMotion, candidate.decidedAt + candidate.margin);
  }
  cache.separatedUntil =
      contacts.verdict() == Verdict::separated ? separatedMotion * (1 - 16 * kRoundoff) : -1;
}

bool isAnyTriangleWithin(const PlacedConvex& body, const TriangleTree& mesh, double limit,
                         MeshCache& cache) {
  Query query(body, mesh, cache);
  if (!(limit > 0)) return false;
  if (!coversDistance(cache, limit)) {
    CandidateUpdate update{query, {limit}, false};
    updateCandidates(update);
  }
  for (Candidate& candidate : cache.candidates) {
    if (isVerdictValid(cache, candidate) && candidate.verdict != Verdict::separated) return true;
    if (computeKnownDistance(cache, candidate) >= limit || proveFarther(query, candidate, limit))
      continue;
    const auto separation = separateCandidate(query, candidate, limit + query.lookahead);
    if (!separation || separation->distance - separation->errorBound >= limit) continue;
    if (separation->distance + separation->errorBound < limit) return true;
    const PlacedConvex triangle{std::span<const Vec3>(query.triangle(candidate))};
    if (isCloserThan(body, triangle, limit, candidate.features)) return true;
  }
  return false;
}

}  // namespace enfilade::collision
