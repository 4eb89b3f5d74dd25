// Which plane parts two bodies? The closest points' is one; of the faces that look along it, that
// of either body may be another. A contact along any of them keeps the bodies apart.
//  - At rest a face's is better: where edges of equal boxes lie above one another the closest
//  points
//    are those of rounded corners, and their normal leans with every hair's breadth.
//  - On the way the one is best under which the motion of now needs to change least. A box that
//    slides over a floor of triangles comes near the edges of those ahead, and the closest points'
//    plane would stop it there; one that falls beside a table's top would be stopped by the top's.
#include "scene/rigid/near_pair.hpp"

#include <algorithm>
#include <cmath>

#include "collision/contact_manifold.hpp"
#include "collision/hull.hpp"

namespace enfilade::scene {
namespace {

using collision::ConvexBody;
using collision::Decision;
using collision::Verdict;

/// Of the way that they could come nearer in a step: looking so much farther saves looking again.
constexpr double kForesight = 1;
/// Of the distance: a face's plane that parts resting bodies by so much is taken.
constexpr double kFaceAtRest = 0.8;
/// Of the lesser radius: a point that wandered less is last step's point.
constexpr double kSamePoint = 0.25;

struct Axis {
  Vec3 normal = Vec3::UnitY();  ///< from A to B
  double gap = 0;               ///< metres
  Vec3 pointA = Vec3::Zero(), pointB = Vec3::Zero();
};

Vec3 worldVertex(const ConvexBody& body, std::size_t i) {
  return (body.rotation ? Vec3(*body.rotation * body.vertices[i]) : body.vertices[i]) +
         body.translation;
}

bool isTriangle(const ConvexBody& body) {
  return !body.hull && body.vertices.size() == 3;
}

Vec3 toBody(const ConvexBody& body, const Vec3& world) {
  return body.rotation ? Vec3(body.rotation->transpose() * world) : world;
}

/// The normal (world) of the face that looks along `direction` most; zero where there are no faces.
Vec3 facing(const Solid& solid, std::uint32_t part, const ConvexBody& body, const Vec3& direction) {
  if (isTriangle(body)) {
    const auto& v = body.vertices;
    const Vec3 normal = (v[1] - v[0]).cross(v[2] - v[0]);
    const double length = normal.norm(), along = normal.dot(toBody(body, direction));
    if (!(length > 0)) return Vec3::Zero();
    const Vec3 world = body.rotation ? Vec3(*body.rotation * normal) : normal;
    return (along < 0 ? -1 : 1) / length * world;
  }
  if (part >= solid.parts.size() || solid.parts[part].faceNormals.empty()) return Vec3::Zero();
  const Vec3 inBody = toBody(body, direction);
  const Vec3* best = nullptr;
  double most = -2;
  for (const Vec3& normal : solid.parts[part].faceNormals) {
    const double along = normal.dot(inBody);
    if (along > most) most = along, best = &normal;
  }
  return body.rotation ? Vec3(*body.rotation * *best) : *best;
}

/// The vertex that is farthest along a direction, in the world.
Vec3 farthest(const ConvexBody& body, const Vec3& direction) {
  const Vec3 inBody = toBody(body, direction);
  std::size_t best = 0;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < body.vertices.size(); ++i) {
    const double along = inBody.dot(body.vertices[i]);
    if (along > most) most = along, best = i;
  }
  return worldVertex(body, best);
}

/// The gap along a normal from A to B.
Axis axisAlong(const Vec3& normal, const ConvexBody& a, const ConvexBody& b) {
  Axis axis{normal, 0, farthest(a, normal), farthest(b, -normal)};
  axis.gap = normal.dot(axis.pointB - axis.pointA);
  // A manifold starts from two points that face one another.
  axis.pointB = axis.pointA + axis.gap * normal;
  return axis;
}

Vec3 velocityToCome(const Solid& solid, const NearPairStep& step) {
  if (!solid.isAwake()) return solid.isFree() ? Vec3(Vec3::Zero()) : solid.motion.velocity;
  return solid.motion.velocity + step.seconds * step.gravity;
}

/// See the file's head. `closest`: the bodies are apart.
Axis axisFor(const Axis& closest, const NearPair& pair, const Solid& a, const Solid& b,
             const NearPairStep& step) {
  const ConvexBody bodyA = partOf(a, pair.key.partA), bodyB = partOf(b, pair.key.partB);
  const Vec3 way = step.seconds * (velocityToCome(b, step) - velocityToCome(a, step));
  const auto room = [&](const Axis& axis) { return axis.gap + axis.normal.dot(way); };
  const bool resting = closest.gap < 2 * step.epsilon;
  Axis best = closest;
  double most = resting ? kFaceAtRest * closest.gap : room(closest);
  const auto consider = [&](const Vec3& normal) {
    if (normal.isZero(0)) return;
    const Axis axis = axisAlong(normal, bodyA, bodyB);
    if (!(axis.gap > 0)) return;
    const double value = resting ? axis.gap : room(axis);
    if (value > most) most = value, best = axis;
  };
  consider(facing(a, pair.key.partA, bodyA, closest.normal));
  consider(-facing(b, pair.key.partB, bodyB, -closest.normal));
  return best;
}

/// Metres by which the pair can close in within the step, by the speeds of now.
double reachOf(const Solid& a, const Solid& b, const NearPairStep& step) {
  const auto velocityOf = [](const Solid& s) {
    return s.asleep ? Vec3(Vec3::Zero()) : s.motion.velocity;
  };
  const auto tipOf = [](const Solid& s) { return s.asleep ? 0 : s.motion.spin.norm() * s.radius; };
  const double speed = (velocityOf(a) - velocityOf(b)).norm() + tipOf(a) + tipOf(b);
  const bool falls = a.isAwake() || b.isAwake();
  const double pushed =
      a.mostPush > 0 || b.mostPush > 0 ? (a.pushVelocity - b.pushVelocity).norm() : 0;
  return step.seconds * (speed + pushed + (falls ? step.gravity.norm() * step.seconds : 0));
}

/// The closest or deepest points, and what is known of the distance.
Axis measure(NearPair& pair, const ConvexBody& a, const ConvexBody& b, const Decision& decision) {
  if (decision.verdict != Verdict::penetrating) {
    pair.apart = decision.distance - decision.errorBound;
    return {decision.normal, decision.distance, decision.pointA, decision.pointB};
  }
  if (!pair.depth) pair.depth = std::make_unique<collision::DepthCache>();
  const collision::Depth depth = collision::penetrationDepth(a, b, pair.features, *pair.depth);
  pair.apart = 0;
  pair.penetration = depth.depth;
  return {depth.normal, -depth.depth, depth.pointA, depth.pointB};
}

Vec3 tangential(const Vec3& v, const Vec3& normal) {
  return v - v.dot(normal) * normal;
}

/// The free body that carries the anchors: B, unless only A is free.
const Solid& anchorBody(const Solid& a, const Solid& b) {
  return b.isFree() ? b : a;
}

/// Which of last step's points, not taken yet, is nearest to an anchor; before.size: none.
std::size_t samePoint(const ContactPatch& before, const PatchAnchors& anchorsBefore,
                      const Vec3& anchor, double same, std::array<bool, 4>& taken) {
  double nearest = same * same;
  std::size_t from = before.size;
  for (std::size_t k = 0; k < before.size; ++k) {
    const double squared = (anchorsBefore[k] - anchor).squaredNorm();
    if (!taken[k] && squared < nearest) nearest = squared, from = k;
  }
  if (from < before.size) taken[from] = true;
  return from;
}

/// Impulses of last step's points go to the points that took their place, and these stand in the
/// order of last step: a solver that takes them in turn comes to rest only so.
void inherit(const ContactPatch& before, const PatchAnchors& anchorsBefore, double same,
             NearPair& pair) {
  ContactPatch& patch = pair.patch;
  std::array<bool, ContactPatch::kMostPoints> taken{};
  std::array<std::size_t, ContactPatch::kMostPoints> from{};
  for (std::size_t i = 0; i < patch.size; ++i) {
    from[i] = samePoint(before, anchorsBefore, pair.anchors[i], same, taken);
    if (from[i] == before.size) continue;
    patch.points[i].impulse = before.points[from[i]].impulse;
    patch.points[i].push = before.points[from[i]].push;
  }
  for (std::size_t i = 1; i < patch.size; ++i)
    for (std::size_t k = i; k > 0 && from[k] < from[k - 1]; --k) {
      std::swap(from[k], from[k - 1]);
      std::swap(patch.points[k], patch.points[k - 1]);
      std::swap(pair.anchors[k], pair.anchors[k - 1]);
    }
  patch.rub = tangential(before.rub, patch.normal);
  patch.twist = before.twist;
}

void setPush(const Solid& a, const Solid& b, ContactPatch& patch) {
  patch.pushSpeed = patch.mostPush = 0;
  for (const Solid* pusher : {&a, &b}) {
    if (pusher->mostPush == 0) continue;
    const double sense = pusher == &a ? 1 : -1;
    patch.pushSpeed = std::max(0.0, sense * patch.normal.dot(pusher->pushVelocity));
    patch.mostPush = patch.pushSpeed > 0 ? pusher->mostPush : 0;
  }
}

void makePatch(NearPair& pair, const Axis& axis, double limit, const Solid& a, const Solid& b) {
  const ContactPatch before = pair.patch;
  const auto anchorsBefore = pair.anchors;
  const collision::ContactManifold manifold = collision::contactManifold(
      partOf(a, pair.key.partA), partOf(b, pair.key.partB),
      {axis.normal, axis.pointA, axis.pointB, limit, ContactPatch::kMostPoints});
  pair.normal = axis.normal;
  ContactPatch& patch = pair.patch;
  patch = ContactPatch{};
  patch.normal = axis.normal;
  patch.friction = std::sqrt(a.motion.friction * b.motion.friction);
  patch.restitution = std::max(a.motion.restitution, b.motion.restitution);
  const Solid& carrier = anchorBody(a, b);
  for (const collision::ContactPoint& point : manifold.list()) {
    pair.anchors[patch.size] =
        carrier.rotation.transpose() * (point.pointB - carrier.motion.centre);
    patch.points[patch.size++] = {point.pointA - a.motion.centre, point.pointB - b.motion.centre,
                                  point.separation, 0, 0};
  }
  setPush(a, b, patch);
  inherit(before, anchorsBefore, kSamePoint * std::min(a.radius, b.radius), pair);
}

}  // namespace

bool look(NearPair& pair, const Solid& a, const Solid& b, const NearPairStep& step) {
  const double reach = reachOf(a, b, step), limit = 2 * step.epsilon + reach;
  if (apartNow(pair, a, b) > limit) {
    pair.patch.size = 0;
    return false;
  }
  const double farthest = limit + kForesight * (reach + step.epsilon);
  const ConvexBody bodyA = partOf(a, pair.key.partA), bodyB = partOf(b, pair.key.partB);
  const auto decision = collision::decideWithin(bodyA, bodyB, farthest, pair.features);
  pair.since = a.jumped + b.jumped;
  pair.penetration = 0;
  pair.verdict = decision ? decision->verdict : Verdict::separated;
  if (!decision) {
    pair.apart = farthest;
    pair.patch.size = 0;
    return true;
  }
  const Axis closest = measure(pair, bodyA, bodyB, *decision);
  if (closest.gap > limit) {
    pair.patch.size = 0;
    return true;
  }
  const Axis axis = closest.gap > 0 ? axisFor(closest, pair, a, b, step) : closest;
  if (axis.gap > limit) {
    pair.patch.size = 0;
  } else {
    makePatch(pair, axis, limit, a, b);
  }
  return true;
}

bool leans(const NearPair& pair, double epsilon) {
  for (const PatchPoint& point : pair.patch.list())
    if (point.separation < 2 * epsilon) return true;
  return false;
}

}  // namespace enfilade::scene
