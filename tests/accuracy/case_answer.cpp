#include "tests/accuracy/case_answer.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "collision/compound/mesh_query.hpp"
#include "collision/motion/shape_cast.hpp"
#include "collision/motion/time_to_contact.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/accuracy/mesh_brute_force.hpp"

namespace enfilade::accuracy {
namespace {

using namespace collision;

constexpr int kRepeats = 3;  // the median of three: one query alone may meet an interrupt

ConvexBody bodyOf(const Hull& hull, const Placed& placed) {
  return {hull.vertices, placed.translation, &placed.rotation, &hull};
}

/// Calls `query()` kRepeats times, the state it starts from put back by `reset()` before each;
/// returns the median of the times in nanoseconds.
template <typename Reset, typename Query>
double timed(const Reset& reset, const Query& query) {
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

void answerAtDecide(const ConvexBody& a, const ConvexBody& b, Warmth& warmth, Answer& answer) {
  const FeatureCache before = warmth.features;
  const DepthCache depthBefore = warmth.depth;
  Decision decision;
  Depth depth;
  const auto reset = [&] { warmth.features = before, warmth.depth = depthBefore; };
  answer.nanoseconds = timed(reset, [&] {
    decision = decide(a, b, warmth.features);
    if (decision.verdict == Verdict::penetrating)
      depth = penetrationDepth(a, b, warmth.features, warmth.depth);
  });
  answer.verdict = decision.verdict;
  answer.decidedBy = decision.decidedBy;
  answer.distance = decision.distance;
  answer.pointA = decision.pointA;
  answer.pointB = decision.pointB;
  answer.errorBound = decision.errorBound;
  if (decision.verdict != Verdict::penetrating || (depth.depth == 0 && !depth.global)) return;
  answer.penetration = depth.depth;
  answer.depthIsGlobal = depth.global;
  answer.errorBound = depth.errorBound;
}

void answerAtRefine(const ConvexBody& a, const ConvexBody& b, Warmth& warmth, Answer& answer) {
  const FeatureCache before = warmth.features;
  Refinement refined;
  const auto reset = [&] { warmth.features = before; };
  answer.nanoseconds = timed(reset, [&] { refined = refine(a, b, warmth.features); });
  answer.verdict = refined.verdict;
  answer.decidedBy = refined.decidedBy;
  answer.distance = refined.distance;
  answer.pointA = refined.pointA;
  answer.pointB = refined.pointB;
  answer.errorBound = 1e-15 * refined.distance;
  if (refined.verdict != Verdict::penetrating) return;
  answer.penetration = refined.penetration;
  answer.depthIsGlobal = true;
  answer.errorBound = 1e-12 * refined.penetration;
}

/// The bound that |vel|, |acc| and the distance alone allow, and the interval of the first contact;
/// where that is not proved, from the last time proved to be before it to the end of the file's
/// view.
void answerCourse(const Course& course, const ConvexBody& a, const ConvexBody& b, Answer& answer) {
  FeatureCache cache;
  const double apart = refine(a, b, cache).distance * (1 - 1e-15);
  const double up = 1 + 0x1p-50;
  answer.tc = timeToContact(apart, {course.velocity.norm() * up, course.acceleration.norm() * up});
  const MovingBody moving{a, {course.velocity, course.acceleration, Vec3::Zero()}};
  const TimeOfImpact impact = timeOfImpact(moving, {b, {}}, kLastTime, cache);
  if (impact.impact != Impact::none) answer.toi = {impact.lo, impact.hi};
}

void answerPair(const Case& asked, Level level, Warmth& warmth, Answer& answer) {
  const Hull hullA = buildHull(asked.a.points);
  const Hull hullB = buildHull(asked.b.points);
  const ConvexBody a = bodyOf(hullA, asked.a);
  const ConvexBody b = bodyOf(hullB, asked.b);
  if (warmth.pointsA != asked.a.points || warmth.pointsB != asked.b.points)
    warmth = {asked.a.points, asked.b.points, {}, {}};
  if (asked.clearance) {
    FeatureCache cache = warmth.features;
    answer.near = isNearerThan(a, b, 2 * *asked.clearance, cache);
  }
  if (asked.course) answerCourse(*asked.course, a, b, answer);
  if (level == Level::decide)
    answerAtDecide(a, b, warmth, answer);
  else
    answerAtRefine(a, b, warmth, answer);
}

ConvexBody bodyOf(const Triangle& triangle) {
  return {triangle};
}

/// The distance of a separated mesh at refine: that of the nearest triangle, if none is nearer by
/// exact comparison; where several are so nearly as near that decide() cannot tell, all of them.
void refineNearest(const ConvexBody& body, const TriangleTree& tree,
                   const std::vector<Triangle>& mesh, MeshCache& cache, MeshContact& contact) {
  FeatureCache features;
  const Refinement refined = refine(body, bodyOf(mesh[*contact.nearest]), features);
  if (isAnythingNearer(body, tree, refined.distance * (1 - 0x1p-51), cache)) {
    contact = bruteForceContact(body, mesh, true);
    return;
  }
  contact.distance = refined.distance;
  contact.errorBound = 1e-15 * refined.distance;
  contact.pointA = refined.pointA;
  contact.pointB = refined.pointB;
}

std::vector<std::uint32_t> givenIndices(const TriangleTree& tree,
                                        const std::vector<std::uint32_t>& triangles) {
  std::vector<std::uint32_t> given;
  for (const std::uint32_t i : triangles) given.push_back(tree.given(i));
  std::sort(given.begin(), given.end());
  return given;
}

MeshContact meshContact(const ConvexBody& body, const TriangleTree& tree,
                        const std::vector<Triangle>& mesh, Level level) {
  MeshCache cache;
  MeshContacts contacts;
  MeshContact contact;
  findContacts(body, tree, cache, contacts);
  const auto nearest = nearestTriangle(body, tree, cache);
  contact.verdict = contacts.verdict();
  contact.penetrated = givenIndices(tree, contacts.penetrated);
  contact.touched = givenIndices(tree, contacts.touched);
  if (!nearest) return contact;
  contact.nearest = tree.given(nearest->triangle);
  contact.decidedBy = nearest->decision.decidedBy;
  contact.distance = nearest->decision.distance;
  contact.errorBound = nearest->decision.errorBound;
  contact.pointA = nearest->decision.pointA;
  contact.pointB = nearest->decision.pointB;
  if (level == Level::refine && contact.verdict == Verdict::separated)
    refineNearest(body, tree, mesh, cache, contact);
  return contact;
}

void answerMesh(const Case& asked, const Meshes& meshes, Level level, Answer& answer) {
  const auto mesh = meshes.find(asked.mesh);
  if (mesh == meshes.end()) throw std::runtime_error("no mesh called " + asked.mesh);
  const Hull hull = buildHull(asked.a.points);
  const ConvexBody body = bodyOf(hull, asked.a);
  const TriangleTree tree(mesh->second);
  MeshContact contact;
  answer.nanoseconds =
      timed([] {}, [&] { contact = meshContact(body, tree, mesh->second, level); });
  answer.verdict = contact.verdict;
  answer.decidedBy = contact.decidedBy;
  answer.distance = contact.distance;
  answer.errorBound = contact.errorBound;
  answer.pointA = contact.pointA;
  answer.pointB = contact.pointB;
  answer.nearestTriangle = contact.nearest;
  answer.penetrated = contact.penetrated;
  answer.touched = contact.touched;
}

std::string number(double value) {
  if (!std::isfinite(value)) return "null";
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

std::string number(const std::optional<double>& value) {
  return value ? number(*value) : "null";
}

std::string numbers(const Vec3& v) {
  return "[" + number(v.x()) + "," + number(v.y()) + "," + number(v.z()) + "]";
}

std::string numbers(const std::vector<std::uint32_t>& list) {
  std::string text = "[";
  for (const std::uint32_t i : list) text += (text.size() > 1 ? "," : "") + std::to_string(i);
  return text + "]";
}

/// A JSON string.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return result + "\"";
}

const char* nameOf(Verdict verdict) {
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

const char* nameOf(DecidedBy by) {
  switch (by) {
    case DecidedBy::filter:
      return "filter";
    case DecidedBy::expansion:
      return "expansion";
    case DecidedBy::rational:
      return "rational";
  }
  return "";
}

std::string meshPart(const Answer& answer) {
  return ",\"nearest_triangle\":" +
         (answer.nearestTriangle ? std::to_string(*answer.nearestTriangle) : "null") +
         ",\"penetrated_triangles\":" + numbers(answer.penetrated) +
         ",\"touched_triangles\":" + numbers(answer.touched);
}

std::string coursePart(const Answer& answer) {
  std::string text = ",\"tc\":" + number(answer.tc) + ",\"toi\":";
  if (!answer.toi) return text + "null";
  return text + "[" + number((*answer.toi)[0]) + "," + number((*answer.toi)[1]) + "]";
}

const char* depthKind(const Answer& answer) {
  if (!answer.penetration) return "null";
  return answer.depthIsGlobal ? "\"global\"" : "\"upper_bound\"";
}

}  // namespace

Answer answerCase(const Case& asked, const Meshes& meshes, Level level, Warmth& warmth) {
  Answer answer;
  answer.id = asked.id;
  try {
    if (asked.mesh.empty())
      answerPair(asked, level, warmth, answer);
    else
      answerMesh(asked, meshes, level, answer);
  } catch (const std::exception& error) {
    answer.error = error.what();
    if (answer.error.empty()) answer.error = "an exception without words";
  }
  return answer;
}

std::string jsonLine(const Case& asked, const Answer& answer) {
  if (!answer.error.empty())
    return "{\"id\":" + quoted(answer.id) + ",\"verdict\":null,\"error\":" + quoted(answer.error) +
           "}";
  std::string line =
      "{\"id\":" + quoted(answer.id) + ",\"verdict\":\"" + nameOf(answer.verdict) +
      "\",\"distance\":" + number(answer.distance) +
      ",\"penetration\":" + number(answer.penetration) + ",\"depth_is\":" + depthKind(answer) +
      ",\"near\":" + (answer.near ? (*answer.near ? "true" : "false") : "null") +
      ",\"point_a\":" + numbers(answer.pointA) + ",\"point_b\":" + numbers(answer.pointB) +
      ",\"error_bound\":" + number(answer.errorBound) + ",\"decided_by\":\"" +
      nameOf(answer.decidedBy) + "\",\"ns\":" + number(answer.nanoseconds);
  if (!asked.mesh.empty()) line += meshPart(answer);
  if (asked.course) line += coursePart(answer);
  return line + "}";
}

}  // namespace enfilade::accuracy
