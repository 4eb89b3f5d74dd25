// Conservative advancement, as collision/continuous_impact.cpp has it, with two simplifications:
// the other body stands, and the parting plane does not turn.
//  1. A plane with normal n parts the bodies by d at s.
//  2. A vertex r of the part, g >= 0 behind the foremost one, moves along n by c = n . (v + w x r)
//     and bends by at most b s^2, b = |n x w| |w| |r| / 2. Until s is larger than the least root of
//       d - low + g - c s - b s^2
//     over all vertices, the plane parts the two by `low` at least.
//  3. Go there, and look again. A stop is where `high` is reached first.
// Departure: collision::timeOfImpact() finds the time of touching; a body must stop before it, at a
// distance, and is near its goal most of the time, where the plane of the nearest face is a good
// one.
#include "scene/bodies/body_sweep.hpp"

#include <algorithm>
#include <cmath>

#include "scene/rotation.hpp"

namespace enfilade::scene {
namespace {

constexpr int kAdvanceBound = 200;        // usual are two or three
constexpr double kSlack = 0x1p-40;        // more than the roundings of a root, relative
constexpr double kWorthAStep = 1.0 / 32;  // of the way: shorter steps, where it is near, end it
constexpr double kLeastStep = 1e-9;       // of the way: less is no progress

/// Least s > 0 with gap - speed s - bend s^2 = 0; gap >= 0, bend >= 0.
double firstRoot(double gap, double speed, double bend) {
  const double root = std::sqrt(speed * speed + 4 * bend * gap);
  if (speed > 0) return 2 * gap / (speed + root);
  if (bend > 0) return (root - speed) / (2 * bend);
  return std::numeric_limits<double>::infinity();
}

/// How much farther the plane along `normal` is proved to leave the bodies more than the gap apart.
double provedStep(const collision::Hull& part, const collision::Mat3& rotation, const BodyWay& way,
                  const Vec3& normal, double gap) {
  const Vec3 spin = way.turn * way.axis;
  const Vec3 inBody = rotation.transpose() * normal;
  const Vec3 turning = rotation.transpose() * normal.cross(spin);  // n . (w x r) = (n x w) . r
  double most = -std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : part.vertices) most = std::max(most, inBody.dot(vertex));
  // n . (w x (w x r)) = (n x w) . (w x r), wherever r has turned to.
  const double bend = 0.5 * turning.norm() * std::abs(way.turn) * (1 + kSlack);
  const double towards = normal.dot(way.move);
  double step = std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : part.vertices) {
    const double behind = std::max(0.0, most - inBody.dot(vertex));
    const double speed = towards + turning.dot(vertex);
    step = std::min(step, firstRoot(gap + behind, speed, bend * vertex.norm()));
  }
  return step * (1 - kSlack);
}

}  // namespace

collision::Mat3 BodyWay::rotationAt(double s) const {
  if (turn == 0 || s == 0) return rotation;
  return rotationAbout(axis, s * turn).normalized().toRotationMatrix() * rotation;
}

BodySweep sweepTurning(const collision::Hull& part, const BodyWay& way,
                       const collision::ConvexBody& other, const collision::StoppingBand& band,
                       QueryCount& count) {
  BodySweep result;
  collision::FeatureCache cache;
  double s = 0;
  for (int i = 0; i < kAdvanceBound; ++i) {
    const collision::Mat3 rotation = way.rotationAt(s);
    const collision::ConvexBody body{part.vertices, way.positionAt(s), &rotation, &part};
    const collision::Decision decision = collision::decide(body, other, cache);
    ++count.narrow;
    if (decision.decidedBy == collision::DecidedBy::rational) ++count.rational;
    result.atStop = decision;
    result.fraction = s;
    result.stopped = true;
    if (decision.verdict != collision::Verdict::separated) return result;
    const double apart = decision.distance - decision.errorBound;
    const double step =
        provedStep(part, rotation, way, decision.normal, std::max(0.0, apart - band.low));
    if (s + step >= 1) return {};
    if (step < (apart <= band.high ? kWorthAStep : kLeastStep)) return result;
    s += step;
  }
  ++count.bounded;
  return result;
}

}  // namespace enfilade::scene
