// Which plane parts two bodies? The closest points' is one; of the faces that look along it, that
// of either body may be another. A contact along any of them keeps the bodies apart.
//  - At rest a face's is better: where edges of equal boxes lie above one another the closest
//    points are those of rounded corners, and their normal leans with every hair's breadth.
//  - On the way the one is best under which the motion of now needs to change least. A box that
//    slides over a floor of triangles comes near the edges of those ahead, and the closest points'
//    plane would stop it there; one that falls beside a table's top would be stopped by the top's.
//
// Most pairs are answered without the narrow phase: their spheres are apart, or the plane that
// parted them last does still, by a proved gap; and who rested on a face goes on to, while the gap
// along it is about the distance of the nearest two points that lie above one another.
#include "scene/physics/body_pair.hpp"

#include <algorithm>
#include <cmath>

#include "collision/narrow_phase/axis_separation.hpp"
#include "collision/narrow_phase/contact_manifold.hpp"
#include "collision/shapes/hull.hpp"

namespace enfilade::scene {
namespace {

using collision::ConvexBody;
using collision::Decision;
using collision::Verdict;

/// Of the way that they could come nearer in a step: looking so much farther saves looking again.
constexpr double kForesight = 1;
/// What two free bodies go past one another, and turn, brings them nearer by what any point of
/// theirs could do at most; of so many epsilons of it this part is foreseen. It is little, so that
/// hardly any momentum is lost where it was more and a proof stops them before they touch.
constexpr double kOfPassing = 0.3, kPassing = 8;
/// Of the distance: a face's plane that parts resting bodies by so much is taken.
constexpr double kFaceAtRest = 0.8;
/// Of the lesser radius: a point that wandered less is last step's point.
constexpr double kSamePoint = 0.25;
/// Of the coordinates: more than what spheres lose by rounding, here and where solids are placed.
constexpr double kOfSpheres = 0x1p-44;
constexpr double kMore = 1 + 0x1p-40;  // above what a few roundings lose
constexpr double kAhead = 0.5;         // cosine: what is pushed within 60 degrees of the way

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

/// The gap along a normal from A to B.
Axis axisAlong(const Vec3& normal, const ConvexBody& a, const collision::Gap& gap) {
  Axis axis{normal, gap.value, worldVertex(a, gap.vertices.a), Vec3::Zero()};
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
             const NearPairStep& step, CloseUp::Plane& plane) {
  const ConvexBody bodyA = partOf(a, pair.key.partA), bodyB = partOf(b, pair.key.partB);
  const Vec3 way = step.seconds * (velocityToCome(b, step) - velocityToCome(a, step));
  const auto room = [&](const Axis& axis) { return axis.gap + axis.normal.dot(way); };
  const bool resting = closest.gap < 2 * step.epsilon;
  Axis best = closest;
  double most = resting ? kFaceAtRest * closest.gap : room(closest);
  const auto consider = [&](const Vec3& normal, CloseUp::Plane of) {
    if (normal.isZero(0)) return;
    const Axis axis = axisAlong(normal, bodyA, collision::gapAlong(bodyA, bodyB, normal));
    if (!(axis.gap > 0)) return;
    const double value = resting ? axis.gap : room(axis);
    if (value > most) most = value, best = axis, plane = of;
  };
  plane = CloseUp::Plane::closest;
  consider(facing(a, pair.key.partA, bodyA, closest.normal), CloseUp::Plane::faceOfA);
  consider(-facing(b, pair.key.partB, bodyB, -closest.normal), CloseUp::Plane::faceOfB);
  return best;
}

Vec3 velocityOf(const Solid& solid) {
  return solid.asleep ? Vec3(Vec3::Zero()) : solid.motion.velocity;
}
/// m/s, by turning.
double tipOf(const Solid& solid) {
  return solid.asleep ? 0 : solid.motion.spin.norm() * solid.radius;
}

/// Metres by which the pair closes in within the step, by the speeds of now.
struct ReachOfPair {
  double most;    ///< were it that of the points that get farthest
  double likely;  ///< of two free bodies less: see kOfPassing
};
ReachOfPair reachOf(const NearPair& pair, const Solid& a, const Solid& b,
                    const NearPairStep& step) {
  const Vec3 velocity = velocityOf(a) - velocityOf(b);
  const bool falls = a.isAwake() || b.isAwake();
  const Vec3 gained = falls ? Vec3(step.seconds * step.gravity) : Vec3(Vec3::Zero());
  const double tips = tipOf(a) + tipOf(b);
  const double pushed =
      a.mostPush > 0 || b.mostPush > 0 ? (a.pushVelocity - b.pushVelocity).norm() : 0;
  const double driven = pushed + a.swing() + b.swing();
  const double most = step.seconds * (velocity.norm() + gained.norm() + tips + driven);
  if (!a.isFree() || !b.isFree() || pair.axis.isZero(0)) return {most, most};
  const double nearer = velocity.dot(pair.axis), falling = gained.dot(pair.axis);
  const double straight = std::max(0.0, nearer) + std::abs(falling) + driven;
  const double passing = step.seconds * (tips + (velocity - nearer * pair.axis).norm() +
                                         (gained - falling * pair.axis).norm());
  const double unlikely = (1 - kOfPassing) * std::min(passing, kPassing * step.epsilon);
  return {most, step.seconds * straight + passing - unlikely};
}

/// The closest or deepest points, and what is known of the distance.
Axis measure(NearPair& pair, const ConvexBody& a, const ConvexBody& b, const Decision& decision) {
  if (decision.verdict != Verdict::penetrating) {
    pair.apart = decision.distance - decision.errorBound;
    return {decision.normal, decision.distance, decision.pointA, decision.pointB};
  }
  CloseUp& close = *pair.close;
  if (!close.depth) close.depth = std::make_unique<collision::DepthCache>();
  const collision::Depth depth = collision::penetrationDepth(a, b, close.features, *close.depth);
  pair.apart = 0;
  close.penetration = depth.depth;
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
             CloseUp& pair) {
  if (before.size == 0) return;
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
  if (!(patch.friction > 0)) return;
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

collision::ContactManifold manifoldOf(const NearPair& pair, const Axis& axis, double limit,
                                      const Solid& a, const Solid& b) {
  const auto normalsOf = [](const Solid& solid, std::uint32_t part) {
    return part < solid.parts.size() ? std::span<const Vec3>(solid.parts[part].faceNormals)
                                     : std::span<const Vec3>();
  };
  return collision::contactManifold(
      partOf(a, pair.key.partA), partOf(b, pair.key.partB),
      {axis.normal, axis.pointA, axis.pointB, limit, ContactPatch::kMostPoints,
       normalsOf(a, pair.key.partA), normalsOf(b, pair.key.partB)});
}

void makePatch(NearPair& pair, const collision::ContactManifold& manifold, const Solid& a,
               const Solid& b) {
  CloseUp& close = *pair.close;
  const ContactPatch before = pair.hasPatch ? close.patch : ContactPatch{};
  const auto anchorsBefore = close.anchors;
  pair.hasPatch = manifold.size > 0;
  pair.axis = manifold.normal;
  ContactPatch& patch = close.patch;
  patch = ContactPatch{};
  patch.normal = manifold.normal;
  patch.restitution = std::max(a.motion.restitution, b.motion.restitution);
  const Solid& carrier = anchorBody(a, b);
  for (const collision::ContactPoint& point : manifold.list()) {
    close.anchors[patch.size] =
        carrier.rotation.transpose() * (point.pointB - carrier.motion.centre);
    patch.points[patch.size++] = {point.pointA - a.motion.centre, point.pointB - b.motion.centre,
                                  point.separation, 0, 0};
  }
  const bool rubs = !isLetOut(pair, a, b);
  patch.friction = rubs ? std::sqrt(a.motion.friction * b.motion.friction) : 0;
  setPush(a, b, patch);
  inherit(before, anchorsBefore, kSamePoint * std::min(a.radius, b.radius), close);
}

// ---- what needs no narrow phase ----------------------------------------------------------------

void setApart(NearPair& pair, double apart, const Solid& a, const Solid& b) {
  pair.apart = apart;
  pair.since = a.jumped + b.jumped;
  pair.verdict = Verdict::separated;
}

/// The spheres about the solids' centres are farther apart than `limit`.
bool farBySpheres(NearPair& pair, const Solid& a, const Solid& b, double limit) {
  const Vec3 between = b.motion.centre - a.motion.centre;
  const double radii = a.radius + b.radius;
  const double least = (radii + limit) * (1 + kOfSpheres);
  if (!(between.squaredNorm() > least * least)) return false;
  const double coordinates =
      a.motion.centre.cwiseAbs().maxCoeff() + b.motion.centre.cwiseAbs().maxCoeff() + radii;
  const double apart = between.norm() - radii - kOfSpheres * coordinates;
  if (!(apart > limit)) return false;
  setApart(pair, apart, a, b);
  return true;
}

/// The axis of last time still parts them by more than `limit`.
bool farAlongAxis(NearPair& pair, const ConvexBody& bodyA, const ConvexBody& bodyB, const Solid& a,
                  const Solid& b, double limit) {
  if (pair.axis.isZero(0) || pair.patch()) return false;
  const collision::Gap gap = collision::gapAlong(bodyA, bodyB, pair.axis);
  if (!(gap.proved > limit)) return false;
  setApart(pair, gap.proved, a, b);
  return true;
}

/// Of the faces that look at the other body, that of A and that of B, the one with the wider gap.
struct FaceGap {
  CloseUp::Plane plane = CloseUp::Plane::closest;  ///< closest: there is no face
  Vec3 normal;
  collision::Gap gap;
};
FaceGap widestFace(const NearPair& pair, const ConvexBody& bodyA, const ConvexBody& bodyB,
                   const Solid& a, const Solid& b, const Vec3& along) {
  FaceGap best;
  const auto consider = [&](const Vec3& normal, CloseUp::Plane plane) {
    if (normal.isZero(0)) return;
    const collision::Gap gap = collision::gapAlong(bodyA, bodyB, normal);
    if (best.plane == CloseUp::Plane::closest || gap.value > best.gap.value)
      best = {plane, normal, gap};
  };
  consider(facing(a, pair.key.partA, bodyA, along), CloseUp::Plane::faceOfA);
  consider(-facing(b, pair.key.partB, bodyB, -along), CloseUp::Plane::faceOfB);
  return best;
}

/// See the file's head.
bool restsAsBefore(NearPair& pair, const ConvexBody& bodyA, const ConvexBody& bodyB, const Solid& a,
                   const Solid& b, double limit, double epsilon) {
  const ContactPatch* patch = pair.patch();
  if (!patch || pair.close->plane == CloseUp::Plane::closest) return false;
  const FaceGap face = widestFace(pair, bodyA, bodyB, a, b, patch->normal);
  if (face.plane == CloseUp::Plane::closest) return false;
  if (!(face.gap.proved > 0 && face.gap.value < 2 * epsilon)) return false;
  const collision::ContactManifold manifold =
      manifoldOf(pair, axisAlong(face.normal, bodyA, face.gap), limit, a, b);
  double nearest = std::numeric_limits<double>::infinity();
  for (const collision::ContactPoint& point : manifold.list())
    nearest = std::min(nearest, point.separation);
  if (!manifold.overlap || !(face.gap.value >= kFaceAtRest * nearest)) return false;
  pair.close->plane = face.plane;
  setApart(pair, face.gap.proved, a, b);
  makePatch(pair, manifold, a, b);
  return true;
}

// ---- what does ---------------------------------------------------------------------------------

/// Leaves the pair without a patch where they are farther apart than `limit`.
void ask(NearPair& pair, const ConvexBody& bodyA, const ConvexBody& bodyB, const Solid& a,
         const Solid& b, double limit, double farthest, const NearPairStep& step) {
  if (!pair.close) pair.close = std::make_unique<CloseUp>();
  CloseUp& close = *pair.close;
  const auto decision = collision::decideWithin(bodyA, bodyB, farthest, close.features);
  setApart(pair, farthest, a, b);
  if (!close.features.axis.isZero(0)) pair.axis = close.features.axis.stableNormalized();
  if (!decision) {
    pair.hasPatch = false;
    return;
  }
  pair.verdict = decision->verdict;
  const Axis closest = measure(pair, bodyA, bodyB, *decision);
  close.plane = CloseUp::Plane::closest;
  Axis axis = closest;
  if (closest.gap > 0 && closest.gap <= limit)
    axis = axisFor(closest, pair, a, b, step, close.plane);
  if (axis.gap > limit) {
    pair.hasPatch = false;
  } else {
    makePatch(pair, manifoldOf(pair, axis, limit, a, b), a, b);
  }
}

}  // namespace

Pace paceOf(const Solid& solid, const Vec3& beside) {
  const double speed = (velocityOf(solid) - beside).norm() + tipOf(solid) + solid.swing();
  return {(speed + solid.pushVelocity.norm()) * kMore, solid.jumped, solid.isFree(),
          solid.isAwake(), solid.isMoved()};
}

bool areFar(const NearPair& pair, const Pace& a, const Pace& b, const NearPairStep& step) {
  const double gained = step.gravity.norm() * step.seconds;
  const double reach = step.seconds * (a.speed + b.speed + gained);
  return apartNow(pair, a.jumped + b.jumped) > (2 * step.epsilon + reach) * kMore;
}

bool look(NearPair& pair, const Solid& a, const Solid& b, const NearPairStep& step) {
  const ReachOfPair reach = reachOf(pair, a, b, step);
  const double limit = 2 * step.epsilon + reach.likely;
  const double farthest = limit + kForesight * (reach.most + step.epsilon);
  if (apartNow(pair, a, b) > limit || farBySpheres(pair, a, b, farthest)) {
    pair.hasPatch = false;
    return false;
  }
  const ConvexBody bodyA = partOf(a, pair.key.partA), bodyB = partOf(b, pair.key.partB);
  if (farAlongAxis(pair, bodyA, bodyB, a, b, limit)) return true;
  if (!restsAsBefore(pair, bodyA, bodyB, a, b, limit, step.epsilon))
    ask(pair, bodyA, bodyB, a, b, limit, farthest, step);
  return true;
}

bool isInDriven(const NearPair& pair, const Solid& a, const Solid& b) {
  return pair.penetration() > 0 && pair.hasPatch && (a.isDriven() || b.isDriven());
}

bool isLetOut(const NearPair& pair, const Solid& a, const Solid& b) {
  if (!isInDriven(pair, a, b)) return false;
  const ContactPatch& patch = *pair.patch();
  const Solid& driven = a.isDriven() ? a : b;
  const Vec3& arm = a.isDriven() ? patch.points[0].armA : patch.points[0].armB;
  const Vec3 velocity = driven.motion.velocity + driven.motion.spin.cross(arm);
  const double ahead = (a.isDriven() ? 1 : -1) * patch.normal.dot(velocity);
  return !(ahead > kAhead * velocity.norm());
}

bool leans(const NearPair& pair, double epsilon) {
  const ContactPatch* patch = pair.patch();
  if (!patch) return false;
  for (const PatchPoint& point : patch->list())
    if (point.separation < 2 * epsilon) return true;
  return false;
}

}  // namespace enfilade::scene
