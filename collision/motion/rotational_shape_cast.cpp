// Conservative advancement (Mirtich 1996, section 2.3) for a turn about a fixed line. With n a
// plane's unit normal, u the axis and r a vertex about the pivot, a turn by phi moves the vertex
// along n by
//   c sin(phi) + k (1 - cos(phi)),  c = n . (u x r),  k = n . (u x (u x r)),
// whose second derivative is at most K = |n x u| |u x r|. A vertex that lies `behind` metres behind
// the plane therefore does not reach it before the root of behind - c phi - K phi^2 / 2. Two planes
// are tried and the longer step is taken: one that stands, which A's vertices come to, and one that
// turns with A, which B's vertices come to the other way round. The second one lets the face of a
// long link close in on a post without counting how fast its far end goes.
//
// Departure: Mirtich bounds the speed of all points by one number.
#include "collision/motion/rotational_shape_cast.hpp"

#include <algorithm>
#include <cmath>

#include "collision/motion/moving_pose.hpp"

namespace enfilade::collision {
namespace {

constexpr int kAdvanceBound = 96;          // steps a target; a dozen is usual
constexpr double kArrived = 1.0 / 32;      // of (high - low): near enough to a target
constexpr double kNearer = 15.0 / 16;      // of a start below low: may come so near before it parts
constexpr double kGrazing = 1e-9;          // of the radius: slower closing is not told from none
constexpr double kRounding = 1 - 0x1p-40;  // taken off each step
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The turn with its sign in the axis.
struct Spin {
  Vec3 pivot, axis;
  double angle;  ///< > 0
};

Vec3 placed(const ConvexBody& body, const Vec3& vertex) {
  return (body.rotation ? Vec3(*body.rotation * vertex) : vertex) + body.translation;
}

/// Least phi > 0 with behind - closing phi - curvature phi^2 / 2 = 0; behind > 0, curvature >= 0.
double firstRoot(double behind, double closing, double curvature) {
  const double root = std::sqrt(closing * closing + 2 * curvature * behind);
  if (closing > 0) return 2 * behind / (closing + root);
  return curvature > 0 ? (root - closing) / curvature : kInfinity;
}

/// Radians that no vertex of `body` needs less of to come `gap` metres along `towards`, the
/// foremost of them that is; others are farther behind.
double turnUntil(const ConvexBody& body, const Vec3& towards, double gap, const Spin& spin) {
  double foremost = -kInfinity;
  for (const Vec3& v : body.vertices)
    foremost = std::max(foremost, towards.dot(placed(body, v) - spin.pivot));
  const Vec3 speed = towards.cross(spin.axis);  // n . (u x r) = (n x u) . r
  const double across = speed.norm();
  double least = kInfinity;
  for (const Vec3& v : body.vertices) {
    const Vec3 r = placed(body, v) - spin.pivot;
    const double behind = gap + (foremost - towards.dot(r));
    const double curvature = across * spin.axis.cross(r).norm();
    least = std::min(least, firstRoot(behind, speed.dot(r), curvature));
  }
  return least;
}

/// A turn for which a gap along `normal` (from A to B) is proved to last.
double provedTurn(const ConvexBody& a, const ConvexBody& b, const Vec3& normal, double gap,
                  const Spin& spin) {
  const double standing = turnUntil(a, normal, gap, spin);
  const double turning = turnUntil(b, -normal, gap, {spin.pivot, -spin.axis, spin.angle});
  return kRounding * std::max(standing, turning);
}

double farthestFrom(const ConvexBody& body, const Vec3& pivot) {
  double squared = 0;
  for (const Vec3& v : body.vertices)
    squared = std::max(squared, (placed(body, v) - pivot).squaredNorm());
  return std::sqrt(squared);
}

struct Advance {
  double fraction;
  bool reached = false;  ///< came as near as the target; else passed with the whole turn
  bool boundReached = false;
  Decision last = {};
};

/// One pair on its way.
struct TurningPair {
  const ConvexBody& a;
  const Turn& turn;
  const ConvexBody& b;
  Spin spin;
  double farthest;  ///< metres, of A's points from the pivot
  FeatureCache& cache;
  SweepResult& result;

  Advance advanceTo(double target, double tolerance, double from) {
    Advance advance{from};
    for (int i = 0; i < kAdvanceBound; ++i) {
      const Placement at = placementAfter(a, turn, advance.fraction);
      const ConvexBody moved{a.vertices, at.translation, &at.rotation, a.hull};
      const double left = (1 - advance.fraction) * spin.angle;
      const auto decision = decideWithin(moved, b, target + tolerance + left * farthest, cache);
      ++result.queries;
      if (!decision) return advance;
      if (decision->decidedBy == DecidedBy::rational) ++result.rationals;
      advance.last = *decision;
      const double gap = decision->distance - decision->errorBound - target;
      if (decision->verdict != Verdict::separated || gap <= tolerance) {
        advance.reached = true;
        return advance;
      }
      advance.fraction += provedTurn(moved, b, decision->normal, gap, spin) / spin.angle;
      if (advance.fraction >= 1) return advance;
    }
    advance.reached = advance.boundReached = true;
    return advance;
  }

  bool partsAt(const Decision& start) const {
    const Vec3 r = start.pointA - spin.pivot;
    return start.normal.dot(spin.axis.cross(r)) <= kGrazing * farthest;
  }
};

}  // namespace

Placement placementAfter(const ConvexBody& body, const Turn& turn, double fraction) {
  const Vec3 spin = turn.angle * turn.axis;
  const Mat3 turnedBy = turned(Mat3::Identity(), spin, fraction);
  return {body.rotation ? turned(*body.rotation, spin, fraction) : turnedBy,
          turn.pivot + turnedBy * (body.translation - turn.pivot)};
}

SweepResult sweepTurning(const ConvexBody& a, const Turn& turn, const ConvexBody& b,
                         const StoppingBand& band, FeatureCache& cache) {
  SweepResult result;
  if (turn.angle == 0) return result;
  const Vec3 axis = turn.angle > 0 ? turn.axis : Vec3(-turn.axis);
  TurningPair pair{
      a,     turn,  b, {turn.pivot, axis, std::abs(turn.angle)}, farthestFrom(a, turn.pivot),
      cache, result};
  double low = band.low, tolerance = kArrived * (band.high - band.low);
  const Advance near = pair.advanceTo(band.high, tolerance, 0);
  if (!near.reached) return result;
  Advance in = near;
  const bool apart = near.last.verdict == Verdict::separated;
  const bool nearAtStart = near.fraction == 0 && near.last.distance <= low + tolerance;
  if (nearAtStart) {
    low = kNearer * near.last.distance;
    tolerance = std::min(tolerance, 0.25 * (near.last.distance - low));
  }
  if (apart && !near.boundReached && !(nearAtStart && !pair.partsAt(near.last)))
    in = pair.advanceTo(low, tolerance, near.fraction);
  if (!in.reached) return result;
  result.stopped = true;
  result.boundReached = in.boundReached;
  result.fraction = near.fraction;
  result.atStop = near.last;
  return result;
}

}  // namespace enfilade::collision
