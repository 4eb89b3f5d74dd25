// Steps
//  1. A plane with normal n separates A and B by `gap` at parameter 0; the kept distance is
//     deducted. Let the plane rotate, too, at omega. With w = q - p for a vertex p of A and q of
//     B, the separation along the rotated normal n(tau) is the minimum n . w. Its derivative is
//       (n . w)' = n . (T' - omega x T) + n . ((wB - omega) x rB) - n . ((wA - omega) x rA),
//     where T is the vector from A's reference point to B's, and r from a body's reference point to
//     its vertex. The second derivative is at most K (below). Up to tau the separation is at least
//       f(tau) = gap - tau v - max over A (tau c - g) - max over B (tau c - g) - K tau^2 / 2
//     with the closing speeds v and c. g >= 0 is the distance of a vertex behind the foremost one.
//     f is concave and f(0) > 0: if f(tau) is positive, the bodies are separated up to tau.
//  2. The step is the root of f. Four rotations of the plane are tried, and the longest step wins.
//     They are none, with B (a face of B is nearest), with A, and the rotation that keeps both
//     nearest edges in their planes. The right one accounts for all first-order terms, so the steps
//     converge quadratically, like Newton's. Without it a swinging door needs hundreds of steps. A
//     further bound treats the bodies as solids of revolution, which only translate.
//
// Departure: Mirtich 1996 bounds the speed of all points by one number and never rotates the plane.
//
// K. For a vertex r of a body that rotates at w, with delta = w - omega, in the frame of the plane:
//   omega x (omega x r) - 2 omega x (w x r) + w x (w x r)
//     = delta x (delta x r) + (delta x omega) x r
// (Jacobi), so at most |delta| (|delta| + |omega|) rho, rho the radius. For T: |T''| + 2 |omega|
// |T'| + |omega|^2 |T|, bounded over the step. If omega = 0, only components along n count: that of
// T'', and n . (w x (w x r)) = (n x w) . (w x r). It is at most |n x w| |w| rho, since the rotation
// keeps the length of w x r.
//
// Rounding. All errors are relative to their own terms; kSlack times the sum of these terms is
// deducted from f.
#include "collision/motion/plane_bound.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "collision/assert.hpp"
#include "collision/floating_point.hpp"
#include "collision/motion/conservative_advancement.hpp"

namespace enfilade::collision {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMaxRootIterations = 32;     // iterations over the lines of f to find its root
constexpr double kSlack = 64 * kRoundoff;  // see the head of this file
constexpr double kMaxGrowth = 16;    // maximum ratio of successive steps with a rotating plane
constexpr int kMaxGrowthSteps = 16;  // attempts at longer steps; a shorter step is also valid

/// Contribution of a vertex to the closing of the gap: tau * speed - behind. The maximum counts.
struct Line {
  double speed;   ///< metres per unit of the parameter
  double behind;  ///< metres, >= 0
};

/// The vertices of a body that rotates at w relative to the plane, along the direction d towards
/// the other body. With r from the reference point: d . r and d . (w x r) = (d x w) . r. Direction
/// and tangent are in the body frame.
struct VertexLines {
  std::span<const Vec3> vertices;
  Vec3 direction, tangent;
  double speedShift, maxSupport, supportError;

  VertexLines(const RotatingBody& body, const Vec3& w, const Vec3& d)
      : vertices(body.body.vertices) {
    const auto toBody = [&](const Vec3& v) {
      return body.body.rotation ? Vec3(body.body.rotation->transpose() * v) : v;
    };
    const Vec3 across = d.cross(w);
    direction = toBody(d), tangent = toBody(across);
    const double magnitude = computeMagnitude(body);
    speedShift = kSlack * magnitude * w.norm() - across.dot(body.reference);
    supportError = kSlack * magnitude;
    maxSupport = -kInfinity;
    for (const Vec3& v : vertices) maxSupport = std::max(maxSupport, direction.dot(v));
  }

  Line findForemost(double tau) const {
    ENFILADE_ASSERT(!vertices.empty());
    Line foremost{0, kInfinity};
    double max = -kInfinity;
    for (const Vec3& v : vertices) {
      const Line line{tangent.dot(v) + speedShift,
                      std::max(0.0, maxSupport - direction.dot(v) - supportError)};
      const double value = tau * line.speed - line.behind;
      if (value > max) max = value, foremost = line;
    }
    return foremost;
  }
};

/// f (see the head of this file) for one rotation of the plane: v is the speed, K the curvature.
struct GapBound {
  double gap = 0, speed = 0, curvature = 0;  ///< metres per unit of the parameter, per its square
  std::optional<VertexLines> a, b;           ///< nullopt: no rotation relative to the plane
};

/// f near tau: gap - tau speed - K tau^2 / 2 with the lines that count there.
struct ActiveLines {
  double gap, speed;
  double lowerBound;  ///< of f(tau)
};

ActiveLines evaluate(const GapBound& f, double tau) {
  ActiveLines at{f.gap, f.speed, 0};
  double errorScale = f.gap + tau * std::abs(f.speed) + f.curvature * tau * tau;
  for (const auto* lines : {&f.a, &f.b}) {
    if (!*lines) continue;
    const Line line = (*lines)->findForemost(tau);
    at.gap += line.behind;
    at.speed += line.speed;
    errorScale += tau * std::abs(line.speed) + line.behind;
  }
  at.lowerBound = at.gap - tau * at.speed - 0.5 * f.curvature * tau * tau - kSlack * errorScale;
  return at;
}

/// Parameter up to which f is proved positive: close to its root, at most `cap`.
double findRoot(const GapBound& f, double cap) {
  if (!(f.gap > 0)) return 0;
  double tau = cap;
  for (int i = 0; i < kMaxRootIterations; ++i) {
    const ActiveLines at = evaluate(f, tau);
    if (at.lowerBound > 0) return tau;
    // If the root does not decrease, its lines were used before: only rounding remains.
    const double root = findFirstRoot(at.gap, at.speed, f.curvature);
    if (!(root < tau)) break;
    tau = root;
  }
  for (double reduction = 0x1p-44; reduction < 1; reduction *= 8) {
    if (evaluate(f, tau).lowerBound > 0) return tau;
    tau *= 1 - reduction;
  }
  return 0;
}

/// Bound of the acceleration of a vertex along the plane's normal n, in the frame of the plane.
double computeCurvature(const RotatingBody& body, const Vec3& n, const Vec3& relativeVelocity,
                        const Vec3& planeVelocity) {
  const double relative = relativeVelocity.norm();
  if (planeVelocity.isZero(0)) {
    const double across = n.cross(relativeVelocity).norm() + kSlack * relative;  // it may cancel
    return across * relative * body.radius;
  }
  return relative * (relative + planeVelocity.norm()) * body.radius;
}

/// Bound for a plane that rotates at `planeAngularVelocity`, valid for steps up to `cap`.
GapBound makeGapBound(const PairMotion& at, const SeparatingPlane& plane,
                      const Vec3& planeAngularVelocity, double cap) {
  const Vec3& n = plane.normal;
  const Vec3 relativeA = at.a.angularVelocity - planeAngularVelocity;
  const Vec3 relativeB = at.b.angularVelocity - planeAngularVelocity;
  GapBound f;
  f.gap = plane.gap - at.keptDistance;
  const double planeSpeed = planeAngularVelocity.norm();
  f.speed = -n.dot(at.velocity - planeAngularVelocity.cross(at.offset)) +
            kSlack * (at.velocity.norm() + planeSpeed * at.offset.norm());
  if (!relativeA.isZero(0)) f.a.emplace(at.a, relativeA, n);
  if (!relativeB.isZero(0)) f.b.emplace(at.b, relativeB, -n);
  const double accelerationNorm = at.acceleration.norm();
  f.curvature = computeCurvature(at.a, n, relativeA, planeAngularVelocity) +
                computeCurvature(at.b, n, relativeB, planeAngularVelocity);
  if (planeSpeed > 0) {
    const double maxSpeed = at.velocity.norm() + accelerationNorm * cap;
    const double maxOffsetSpeed =
        planeAngularVelocity.cross(at.offset).norm() + planeSpeed * maxSpeed * cap;
    f.curvature += accelerationNorm + 2 * planeSpeed * maxSpeed + planeSpeed * maxOffsetSpeed +
                   kSlack * planeSpeed * planeSpeed * at.offset.norm();
  } else {
    f.curvature += std::max(0.0, -n.dot(at.acceleration)) + kSlack * accelerationNorm;
  }
  f.curvature *= 1 + kSlack;
  return f;
}

/// Angular velocity of the plane that keeps the two nearest edges parallel to it. nullopt if the
/// nearest features are not two edges.
std::optional<Vec3> findEdgeRotation(const PairMotion& at, const Vec3& n,
                                     const FeatureCache& features) {
  if (features.size < 2 || features.size > 3) return std::nullopt;
  const VertexPair first = features.pairs[0];
  std::uint32_t otherA = first.a, otherB = first.b;
  for (int i = 1; i < features.size; ++i) {
    if (features.pairs[i].a != first.a) otherA = features.pairs[i].a;
    if (features.pairs[i].b != first.b) otherB = features.pairs[i].b;
  }
  if (otherA == first.a || otherB == first.b) return std::nullopt;
  const auto findEdge = [](const PlacedConvex& body, std::uint32_t from, std::uint32_t to) {
    // A cache of other bodies. Without an edge the rotation below is not finite.
    if (std::max(from, to) >= body.vertices.size()) return Vec3(Vec3::Zero());
    const Vec3 edge = body.vertices[to] - body.vertices[from];
    return body.rotation ? Vec3(*body.rotation * edge) : edge;
  };
  const Vec3 edgeA = findEdge(at.a.body, first.a, otherA),
             edgeB = findEdge(at.b.body, first.b, otherB);
  const Vec3 acrossA = edgeA.cross(n), acrossB = edgeB.cross(n);
  // n' . edge = -n . (w x edge) for both, n' . n = 0.
  const Vec3 change = -n.dot(at.a.angularVelocity.cross(edgeA)) / edgeA.dot(acrossB) * acrossB -
                      n.dot(at.b.angularVelocity.cross(edgeB)) / edgeB.dot(acrossA) * acrossA;
  const Vec3 angularVelocity = n.cross(change);
  return angularVelocity.allFinite() ? std::optional(angularVelocity) : std::nullopt;
}

/// Maximum projection on `n` of any vertex for any rotation about the body's axis.
double computeRevolvedSupport(const RotatingBody& body, const Vec3& n) {
  const bool rotates = !body.angularVelocity.isZero(0);
  const Vec3 axis = rotates ? Vec3(body.angularVelocity.normalized()) : Vec3(Vec3::Zero());
  const double axial = n.dot(axis);
  const double radial = (n - axial * axis).norm();
  double maxSupport = -kInfinity;
  for (const Vec3& v : body.body.vertices) {
    const Vec3 r = (body.body.rotation ? Vec3(*body.body.rotation * v) : v) - body.reference;
    const double height = r.dot(axis);
    maxSupport = std::max(
        maxSupport, rotates ? axial * height + radial * (r - height * axis).norm() : n.dot(r));
  }
  return maxSupport + kSlack * computeMagnitude(body);
}

/// Step for the solids of revolution of the bodies, which only translate. Long for distant bodies
/// and for a body that rotates in free space.
double computeRevolvedStep(const PairMotion& at, const Vec3& n, double cap) {
  const double accelerationNorm = at.acceleration.norm();
  GapBound f;
  f.gap = n.dot(at.offset) - computeRevolvedSupport(at.a, n) - computeRevolvedSupport(at.b, -n) -
          at.keptDistance - kSlack * (at.offset.norm() + at.keptDistance);
  f.speed = -n.dot(at.velocity) + kSlack * at.velocity.norm();
  f.curvature = std::max(0.0, -n.dot(at.acceleration)) + kSlack * accelerationNorm;
  return findRoot(f, cap);
}

}  // namespace

double computeMagnitude(const RotatingBody& body) {
  return (body.body.rotation ? 2 : 1) * body.radius + 3 * body.reference.norm();
}

double computeCertifiedStep(const PairMotion& at, const SeparatingPlane& plane,
                            const FeatureCache& features, double cap) {
  double best = findRoot(makeGapBound(at, plane, Vec3::Zero(), cap), cap);
  if (best >= cap) return best;
  if (at.a.angularVelocity.isZero(0) && at.b.angularVelocity.isZero(0)) return best;
  best = std::max(best, computeRevolvedStep(at, plane.normal, cap));
  const double length = at.offset.norm();
  if (length > 0) best = std::max(best, computeRevolvedStep(at, at.offset / length, cap));
  const auto tryRotatingPlane = [&](const Vec3& planeAngularVelocity) {
    // The curvature bound grows with the step length, so the step is extended gradually.
    bool reached = !planeAngularVelocity.isZero(0) && best > 0;
    for (int i = 0; i < kMaxGrowthSteps && reached && best < cap; ++i) {
      const double maxStep = std::min(cap, kMaxGrowth * best);
      const double step = findRoot(makeGapBound(at, plane, planeAngularVelocity, maxStep), maxStep);
      reached = step >= maxStep;
      best = std::max(best, step);
    }
  };
  tryRotatingPlane(at.b.angularVelocity);
  tryRotatingPlane(at.a.angularVelocity);
  if (const auto edgeAngularVelocity = findEdgeRotation(at, plane.normal, features))
    tryRotatingPlane(*edgeAngularVelocity);
  return best;
}

}  // namespace enfilade::collision
