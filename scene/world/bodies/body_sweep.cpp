// Conservative advancement, as collision/motion/conservative_advancement.cpp has it, with a
// simplification: the parting plane does not turn.
//  1. A plane with normal n parts the bodies by d at s.
//  2. A vertex r of the part, g >= 0 behind the foremost one, moves along n by c = n . (v + w x r)
//     and bends by at most b s^2, b = |n x w| |w| |r| / 2. Until s is larger than the least root of
//       d - low + g - c s - b s^2
//     over all vertices, the plane parts the two by `low` at least.
//  3. Go there, and look again. A stop is where `high` is reached first.
// Of two that move, the plane goes along with the second one; if both turn, each may use up half of
// d - low.
// Departure: collision::timeOfImpact() finds the time of touching; a body must stop before it, at a
// distance, and is near its goal most of the time, where the plane of the nearest face is a good
// one.
#include "scene/world/bodies/body_sweep.hpp"

#include <algorithm>
#include <cmath>

#include "scene/model/rotation.hpp"

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
double provedStep(const MovingPart& part, const collision::Mat3& rotation, const Vec3& normal,
                  double gap) {
  const BodyWay& way = part.way;
  const Vec3 spin = way.turn * way.axis;
  const Vec3 inBody = rotation.transpose() * normal;
  const Vec3 turning = rotation.transpose() * normal.cross(spin);  // n . (w x r) = (n x w) . r
  double most = -std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : part.hull.vertices) most = std::max(most, inBody.dot(vertex));
  // n . (w x (w x r)) = (n x w) . (w x r), wherever r has turned to.
  const double bend = 0.5 * turning.norm() * std::abs(way.turn) * (1 + kSlack);
  const double towards = normal.dot(way.move);
  double step = std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : part.hull.vertices) {
    const double behind = std::max(0.0, most - inBody.dot(vertex));
    const double speed = towards + turning.dot(vertex);
    step = std::min(step, firstRoot(gap + behind, speed, bend * vertex.norm()));
  }
  return step * (1 - kSlack);
}

collision::ConvexBody bodyAt(const MovingPart& part, double s, const collision::Mat3& rotation) {
  return {part.hull.vertices, part.way.positionAt(s), &rotation, &part.hull};
}

/// `look` at the two at a part s of their ways; then `step` farther, by a plane and its gap.
template <class Look, class Step>
BodySweep advance(const collision::StoppingBand& band, QueryCount& count, Look look, Step step) {
  BodySweep result;
  double s = 0;
  for (int i = 0; i < kAdvanceBound; ++i) {
    const collision::Decision decision = look(s);
    ++count.narrow;
    if (decision.decidedBy == collision::DecidedBy::rational) ++count.rational;
    result.atStop = decision;
    result.fraction = s;
    result.stopped = true;
    const double apart = decision.distance - decision.errorBound;
    result.reached = decision.verdict != collision::Verdict::separated || apart <= band.high;
    if (decision.verdict != collision::Verdict::separated) return result;
    const double proved = step(decision.normal, std::max(0.0, apart - band.low));
    if (s + proved >= 1) return {};
    if (proved < (apart <= band.high ? kWorthAStep : kLeastStep)) return result;
    s += proved;
  }
  ++count.bounded;
  return result;
}

}  // namespace

collision::Mat3 BodyWay::rotationAt(double s) const {
  if (turn == 0 || s == 0) return rotation;
  return rotationAbout(axis, s * turn).normalized().toRotationMatrix() * rotation;
}

BodySweep sweepTurning(const MovingPart& part, const collision::ConvexBody& other,
                       const collision::StoppingBand& band, QueryCount& count) {
  collision::FeatureCache cache;
  collision::Mat3 rotation;
  return advance(
      band, count,
      [&](double s) {
        rotation = part.way.rotationAt(s);
        return collision::decide(bodyAt(part, s, rotation), other, cache);
      },
      [&](const Vec3& normal, double gap) { return provedStep(part, rotation, normal, gap); });
}

BodySweep sweepTurning(const MovingPart& part, const MovingPart& other,
                       const collision::StoppingBand& band, QueryCount& count) {
  collision::FeatureCache cache;
  collision::Mat3 rotation, otherRotation;
  BodyWay relative = part.way, turning = other.way;
  relative.move -= other.way.move;
  turning.move = Vec3::Zero();
  const double share = turning.turn == 0 ? 1 : 0.5;
  return advance(
      band, count,
      [&](double s) {
        rotation = part.way.rotationAt(s);
        otherRotation = other.way.rotationAt(s);
        return collision::decide(bodyAt(part, s, rotation), bodyAt(other, s, otherRotation), cache);
      },
      [&](const Vec3& normal, double gap) {
        const double step = provedStep({part.hull, relative}, rotation, normal, share * gap);
        if (turning.turn == 0) return step;
        return std::min(step, provedStep({other.hull, turning}, otherRotation, -normal, gap / 2));
      });
}

}  // namespace enfilade::scene
