#include "tests/accuracy/case_answer.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "collision/compound/nearest_parts.hpp"
#include "collision/motion/time_of_impact.hpp"
#include "collision/motion/time_to_contact.hpp"
#include "collision/shapes/hull.hpp"
#include "collision/shapes/triangle_tree.hpp"
#include "tests/accuracy/mesh_brute_force.hpp"

namespace enfilade::accuracy {
namespace {

using namespace collision;

constexpr int kRepeats = 3;  // the median of three: an interrupt may disturb a single query

PlacedConvex makeConvex(const Hull& hull, const Placed& placed) {
  return {hull.vertices, placed.translation, &placed.rotation, &hull};
}

/// Calls `query()` kRepeats times, each after `reset()` restores the initial state. Returns the
/// median time in nanoseconds.
template <typename Reset, typename Query>
double measureTime(const Reset& reset, const Query& query) {
  std::array<double, kRepeats> times{};
  for (double& time : times) {
    reset();
    const auto start = std::chrono::steady_clock::now();
    query();
    const auto end = std::chrono::steady_clock::now();
    time = static_cast<double>(
        std::chrono::duration_cast<std::chrono::nanoseconds>(end - start).count());
  }
  std::sort(times.begin(), times.end());
  return times[kRepeats / 2];
}

void answerAtDecide(const PlacedConvex& a, const PlacedConvex& b, WarmStart& warmth,
                    Answer& answer) {
  const FeatureCache before = warmth.features;
  const DepthCache depthBefore = warmth.depth;
  SeparationResult separation;
  PenetrationResult depth;
  const auto reset = [&] { warmth.features = before, warmth.depth = depthBefore; };
  answer.nanoseconds = measureTime(reset, [&] {
    separation = computeSeparation(a, b, warmth.features);
    if (separation.verdict == Verdict::penetrating)
      depth = computePenetrationDepth(a, b, warmth.features, warmth.depth);
  });
  answer.verdict = separation.verdict;
  answer.certificate = separation.certificate;
  answer.distance = separation.distance;
  answer.pointA = separation.pointA;
  answer.pointB = separation.pointB;
  answer.errorBound = separation.errorBound;
  if (separation.verdict != Verdict::penetrating || (depth.depth == 0 && !depth.global)) return;
  answer.penetration = depth.depth;
  answer.depthIsGlobal = depth.global;
  answer.errorBound = depth.errorBound;
}

void answerAtRefine(const PlacedConvex& a, const PlacedConvex& b, WarmStart& warmth,
                    Answer& answer) {
  const FeatureCache before = warmth.features;
  RefinedSeparation refined;
  const auto reset = [&] { warmth.features = before; };
  answer.nanoseconds =
      measureTime(reset, [&] { refined = refineSeparation(a, b, warmth.features); });
  answer.verdict = refined.verdict;
  answer.certificate = refined.certificate;
  answer.distance = refined.distance;
  answer.pointA = refined.pointA;
  answer.pointB = refined.pointB;
  answer.errorBound = 1e-15 * refined.distance;
  if (refined.verdict != Verdict::penetrating) return;
  answer.penetration = refined.penetration;
  answer.depthIsGlobal = true;
  answer.errorBound = 1e-12 * refined.penetration;
}

/// Computes the bound from |vel|, |acc| and the distance alone, and the interval of the first
/// contact. If the contact is not certified, the interval starts at the last certified time before
/// it and ends at kLastTime.
void answerCourse(const Course& course, const PlacedConvex& a, const PlacedConvex& b,
                  Answer& answer) {
  FeatureCache cache;
  const double separation = refineSeparation(a, b, cache).distance * (1 - 1e-15);
  const double up = 1 + 0x1p-50;
  answer.tc = computeTimeToContact(separation,
                                   {course.velocity.norm() * up, course.acceleration.norm() * up});
  const MovingBody moving{a, {course.velocity, course.acceleration, Vec3::Zero()}};
  const MotionResult impact = computeTimeOfImpact(moving, {b, {}}, kLastTime, cache);
  if (impact.outcome != MotionOutcome::clear) answer.toi = {impact.lo, impact.hi};
}

void answerPair(const Case& testCase, Level level, WarmStart& warmth, Answer& answer) {
  const Hull hullA = buildHull(testCase.a.points);
  const Hull hullB = buildHull(testCase.b.points);
  const PlacedConvex a = makeConvex(hullA, testCase.a);
  const PlacedConvex b = makeConvex(hullB, testCase.b);
  if (warmth.pointsA != testCase.a.points || warmth.pointsB != testCase.b.points)
    warmth = {testCase.a.points, testCase.b.points, {}, {}};
  if (testCase.clearance) {
    FeatureCache cache = warmth.features;
    answer.near = isCloserThan(a, b, 2 * *testCase.clearance, cache);
  }
  if (testCase.course) answerCourse(*testCase.course, a, b, answer);
  if (level == Level::decide)
    answerAtDecide(a, b, warmth, answer);
  else
    answerAtRefine(a, b, warmth, answer);
}

PlacedConvex makeConvex(const Triangle& triangle) {
  return {triangle};
}

/// Indices of the triangles that may touch the body or be the nearest, ascending.
std::vector<std::uint32_t> findCandidates(const PlacedConvex& body, const TriangleTree& tree) {
  Aabb box, localBox;
  for (const Vec3& vertex : body.vertices) {
    localBox.include(vertex);
    box.include(*body.rotation * vertex + body.translation);
  }
  const BoxTree bodyTree = buildBoxTree({&localBox, 1}, 1);
  const CompoundView bodyView{&bodyTree, *body.rotation, body.translation,
                              [&](std::uint32_t) { return body; }};
  const CompoundView meshView{&tree.boxes(), Mat3::Identity(), Vec3::Zero(),
                              [&](std::uint32_t i) { return makeConvex(tree.triangles()[i]); },
                              [&](std::uint32_t i) { return computeAabb(tree.triangles()[i]); }};
  std::size_t budget = std::numeric_limits<std::size_t>::max();
  const NearestParts nearest = findNearestParts({&bodyView, 1}, {&meshView, 1},
                                                std::numeric_limits<double>::infinity(), budget);
  const double magnitude = 1 + box.min.cwiseAbs().maxCoeff() + box.max.cwiseAbs().maxCoeff();
  std::vector<std::uint32_t> candidates;
  tree.query(inflate(box, nearest.separation.distance * (1 + 1e-9) + 1e-12 * magnitude),
             candidates);
  for (std::uint32_t& candidate : candidates) candidate = tree.inputIndex(candidate);
  std::sort(candidates.begin(), candidates.end());
  return candidates;
}

/// The contact by the tree of the triangles: only candidates are asked.
MeshContact computeMeshContact(const PlacedConvex& body, const TriangleTree& tree,
                               const std::vector<Triangle>& mesh, Level level) {
  const std::vector<std::uint32_t> candidates = findCandidates(body, tree);
  std::vector<Triangle> triangles;
  for (const std::uint32_t i : candidates) triangles.push_back(mesh[i]);
  MeshContact contact = findContactByBruteForce(body, triangles, level == Level::refine);
  for (auto* list : {&contact.penetrated, &contact.touched})
    for (std::uint32_t& i : *list) i = candidates[i];
  if (contact.nearest) contact.nearest = candidates[*contact.nearest];
  return contact;
}

void answerMesh(const Case& testCase, const Meshes& meshes, Level level, Answer& answer) {
  const auto mesh = meshes.find(testCase.mesh);
  if (mesh == meshes.end()) throw std::runtime_error("unknown mesh " + testCase.mesh);
  const Hull hull = buildHull(testCase.a.points);
  const PlacedConvex body = makeConvex(hull, testCase.a);
  const TriangleTree tree(mesh->second);
  MeshContact contact;
  answer.nanoseconds =
      measureTime([] {}, [&] { contact = computeMeshContact(body, tree, mesh->second, level); });
  answer.verdict = contact.verdict;
  answer.certificate = contact.decidedBy;
  answer.distance = contact.distance;
  answer.errorBound = contact.errorBound;
  answer.pointA = contact.pointA;
  answer.pointB = contact.pointB;
  answer.nearestTriangle = contact.nearest;
  answer.penetrated = contact.penetrated;
  answer.touched = contact.touched;
}

std::string formatNumber(double value) {
  if (!std::isfinite(value)) return "null";
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

std::string formatNumber(const std::optional<double>& value) {
  return value ? formatNumber(*value) : "null";
}

std::string formatNumbers(const Vec3& v) {
  return "[" + formatNumber(v.x()) + "," + formatNumber(v.y()) + "," + formatNumber(v.z()) + "]";
}

std::string formatNumbers(const std::vector<std::uint32_t>& list) {
  std::string text = "[";
  for (const std::uint32_t i : list) text += (text.size() > 1 ? "," : "") + std::to_string(i);
  return text + "]";
}

/// Formats a JSON string.
std::string quote(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return result + "\"";
}

const char* toString(Verdict verdict) {
  switch (verdict) {
    case Verdict::separated:
      return "separated";
    case Verdict::touching:
      return "touching";
    case Verdict::penetrating:
      return "penetrating";
  }
  return "";
}

const char* toString(Certificate by) {
  switch (by) {
    case Certificate::filter:
      return "filter";
    case Certificate::expansion:
      return "expansion";
    case Certificate::rational:
      return "rational";
  }
  return "";
}

std::string formatMeshFields(const Answer& answer) {
  return ",\"nearest_triangle\":" +
         (answer.nearestTriangle ? std::to_string(*answer.nearestTriangle) : "null") +
         ",\"penetrated_triangles\":" + formatNumbers(answer.penetrated) +
         ",\"touched_triangles\":" + formatNumbers(answer.touched);
}

std::string formatCourseFields(const Answer& answer) {
  std::string text = ",\"tc\":" + formatNumber(answer.tc) + ",\"toi\":";
  if (!answer.toi) return text + "null";
  return text + "[" + formatNumber((*answer.toi)[0]) + "," + formatNumber((*answer.toi)[1]) + "]";
}

const char* formatDepthKind(const Answer& answer) {
  if (!answer.penetration) return "null";
  return answer.depthIsGlobal ? "\"global\"" : "\"upper_bound\"";
}

}  // namespace

Answer answerCase(const Case& testCase, const Meshes& meshes, Level level, WarmStart& warmth) {
  Answer answer;
  answer.id = testCase.id;
  try {
    if (testCase.mesh.empty())
      answerPair(testCase, level, warmth, answer);
    else
      answerMesh(testCase, meshes, level, answer);
  } catch (const std::exception& error) {
    answer.error = error.what();
    if (answer.error.empty()) answer.error = "an exception without a message";
  }
  return answer;
}

std::string formatJsonLine(const Case& testCase, const Answer& answer) {
  if (!answer.error.empty())
    return "{\"id\":" + quote(answer.id) + ",\"verdict\":null,\"error\":" + quote(answer.error) +
           "}";
  std::string line = "{\"id\":" + quote(answer.id) + ",\"verdict\":\"" + toString(answer.verdict) +
                     "\",\"distance\":" + formatNumber(answer.distance) +
                     ",\"penetration\":" + formatNumber(answer.penetration) +
                     ",\"depth_is\":" + formatDepthKind(answer) +
                     ",\"near\":" + (answer.near ? (*answer.near ? "true" : "false") : "null") +
                     ",\"point_a\":" + formatNumbers(answer.pointA) +
                     ",\"point_b\":" + formatNumbers(answer.pointB) +
                     ",\"error_bound\":" + formatNumber(answer.errorBound) + ",\"decided_by\":\"" +
                     toString(answer.certificate) + "\",\"ns\":" + formatNumber(answer.nanoseconds);
  if (!testCase.mesh.empty()) line += formatMeshFields(answer);
  if (testCase.course) line += formatCourseFields(answer);
  return line + "}";
}

}  // namespace enfilade::accuracy
