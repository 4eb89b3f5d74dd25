#include "scene/physics/joint.hpp"

#include <limits>

#include "scene/model/rotation.hpp"

namespace enfilade::scene {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDegreesPerRadian = 57.29577951308232;

/// A unit vector at right angles to a unit one.
Vec3 across(const Vec3& axis) {
  int least = 0;
  axis.cwiseAbs().minCoeff(&least);
  return axis.cross(Vec3::Unit(least)).normalized();
}

/// The joint where the bodies are now, in the world.
struct Placed {
  Vec3 armA, armB, axis, first, second;  ///< first, second: across A's axis
  Vec3 axisB, acrossA, acrossB, apart;   ///< apart: from A's anchor to B's

  Placed(const Joint& joint, const RigidBody& a, const RigidBody& b) {
    const Mat3 turnA = a.rotation.toRotationMatrix(), turnB = b.rotation.toRotationMatrix();
    armA = turnA * joint.anchorA, armB = turnB * joint.anchorB;
    axis = turnA * joint.axisA, axisB = turnB * joint.axisB;
    acrossA = turnA * joint.acrossA, acrossB = turnB * joint.acrossB;
    first = acrossA, second = axis.cross(acrossA);
    apart = (b.centre + armB) - (a.centre + armA);
  }
};

/// Appends the rows of one joint, in the order of their slots.
struct RowWriter {
  std::vector<JointRow>& rows;
  std::uint32_t joint;
  std::uint32_t slot = 0;

  JointRow& add() {
    rows.emplace_back();
    rows.back().joint = joint;
    rows.back().slot = slot++;
    rows.back().least = -kInfinity, rows.back().most = kInfinity;
    return rows.back();
  }
  /// B's anchor moves along `direction`; A's arm reaches to B's anchor, so that a slider's turns
  /// with it.
  JointRow& addLinear(const Placed& at, const Vec3& direction, const Vec3& reachA) {
    JointRow& row = add();
    row.linear = direction;
    row.angularA = reachA.cross(direction), row.angularB = at.armB.cross(direction);
    row.error = at.apart.dot(direction);
    return row;
  }
  JointRow& addAngular(const Vec3& direction, double error) {
    JointRow& row = add();
    row.angularA = row.angularB = direction;
    row.error = error;
    return row;
  }
};

void limit(JointRow& row, double from) {
  row.kind = JointRow::Kind::limit;
  row.error = from;
  row.least = 0;
}

void drive(JointRow& row, const Joint& joint, double seconds) {
  row.kind = JointRow::Kind::motor;
  row.speed = joint.motorSpeed;
  row.least = -joint.mostMotor * seconds, row.most = joint.mostMotor * seconds;
}

/// Sine and cosine of an angle less the joint's: how far it is from a limit, up to a quarter turn.
struct Turned {
  double sine, cosine;
};
Turned turnedFrom(const Placed& at, double radians) {
  const double cosine = at.acrossA.dot(at.acrossB);
  const double sine = at.axis.dot(at.acrossA.cross(at.acrossB));
  const Vec3 limit = headingFromDegrees(radians * kDegreesPerRadian);  // (cos, 0, -sin)
  const double limitCosine = limit.x(), limitSine = -limit.z();
  return {sine * limitCosine - cosine * limitSine, cosine * limitCosine + sine * limitSine};
}

void appendHinge(const Joint& joint, const Placed& at, double seconds, RowWriter writer) {
  for (int k = 0; k < 3; ++k) writer.addLinear(at, Vec3::Unit(k), at.armA);
  const Vec3 tilt = at.axis.cross(at.axisB);
  writer.addAngular(at.first, tilt.dot(at.first));
  writer.addAngular(at.second, tilt.dot(at.second));
  if (joint.mostMotor > 0) drive(writer.addAngular(at.axis, 0), joint, seconds);
  if (!joint.limited) return;
  writer.slot = 6;
  const Turned fromLower = turnedFrom(at, joint.lower), fromUpper = turnedFrom(at, joint.upper);
  if (fromLower.cosine > 0) limit(writer.addAngular(at.axis, 0), fromLower.sine);
  writer.slot = 7;
  if (fromUpper.cosine > 0) limit(writer.addAngular(-at.axis, 0), -fromUpper.sine);
}

void appendSlider(const Joint& joint, const Placed& at, double seconds, RowWriter writer) {
  const Vec3 reachA = at.armA + at.apart;
  writer.addLinear(at, at.first, reachA);
  writer.addLinear(at, at.second, reachA);
  const Vec3 turn = 0.5 * (at.axis.cross(at.axisB) + at.acrossA.cross(at.acrossB) +
                           at.second.cross(at.axisB.cross(at.acrossB)));
  for (int k = 0; k < 3; ++k) writer.addAngular(Vec3::Unit(k), turn[k]);
  const double along = at.apart.dot(at.axis);
  if (joint.mostMotor > 0) drive(writer.addLinear(at, at.axis, reachA), joint, seconds);
  if (!joint.limited) return;
  writer.slot = 6;
  limit(writer.addLinear(at, at.axis, reachA), along - joint.lower);
  limit(writer.addLinear(at, -at.axis, reachA), joint.upper - along);
}

}  // namespace

Joint jointAt(Joint::Kind kind, std::span<const RigidBody> bodies, std::uint32_t a, std::uint32_t b,
              const Vec3& point, const Vec3& axis) {
  const Mat3 aFromWorld = bodies[a].rotation.toRotationMatrix().transpose();
  const Mat3 bFromWorld = bodies[b].rotation.toRotationMatrix().transpose();
  Joint joint;
  joint.kind = kind;
  joint.a = a, joint.b = b;
  joint.anchorA = aFromWorld * (point - bodies[a].centre);
  joint.anchorB = bFromWorld * (point - bodies[b].centre);
  const Vec3 unit = axis.normalized(), side = across(unit);
  joint.axisA = aFromWorld * unit, joint.axisB = bFromWorld * unit;
  joint.acrossA = aFromWorld * side, joint.acrossB = bFromWorld * side;
  return joint;
}

void appendRows(const Joint& joint, std::uint32_t index, std::span<const RigidBody> bodies,
                double seconds, std::vector<JointRow>& rows) {
  const Placed at(joint, bodies[joint.a], bodies[joint.b]);
  if (joint.kind == Joint::Kind::hinge) {
    appendHinge(joint, at, seconds, {rows, index});
  } else {
    appendSlider(joint, at, seconds, {rows, index});
  }
}

}  // namespace enfilade::scene
