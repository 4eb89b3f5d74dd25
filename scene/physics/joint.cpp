#include "scene/physics/joint.hpp"

#include <limits>

#include "collision/assert.hpp"
#include "scene/model/rotation.hpp"

namespace enfilade::scene {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDegreesPerRadian = 57.29577951308232;

/// Returns a unit vector perpendicular to a unit vector.
Vec3 computePerpendicular(const Vec3& axis) {
  int minIndex = 0;
  axis.cwiseAbs().minCoeff(&minIndex);
  return axis.cross(Vec3::Unit(minIndex)).normalized();
}

/// A joint in world axes for the present poses.
struct PlacedJoint {
  Vec3 armA, armB, axis, perpendicular1, perpendicular2;  ///< perpendiculars of A's axis
  Vec3 axisB, perpendicularA, perpendicularB,
      anchorOffset;  ///< anchorOffset: from A's anchor to B's

  PlacedJoint(const Joint& joint, const BodyMotion& a, const BodyMotion& b) {
    const Mat3 rotationA = a.rotation.toRotationMatrix(), rotationB = b.rotation.toRotationMatrix();
    armA = rotationA * joint.anchorA, armB = rotationB * joint.anchorB;
    axis = rotationA * joint.axisA, axisB = rotationB * joint.axisB;
    perpendicularA = rotationA * joint.perpendicularA,
    perpendicularB = rotationB * joint.perpendicularB;
    perpendicular1 = perpendicularA, perpendicular2 = axis.cross(perpendicularA);
    anchorOffset = (b.centre + armB) - (a.centre + armA);
  }
};

/// Appends the rows of one joint, in the order of their slots.
struct RowWriter {
  std::vector<JointRow>& rows;
  std::uint32_t joint;
  std::uint32_t slot = 0;

  JointRow& addRow() {
    rows.emplace_back();
    ENFILADE_ASSERT(slot < Joint::kMaxRows);
    rows.back().joint = joint;
    rows.back().slot = slot++;
    rows.back().minImpulse = -kInfinity, rows.back().maxImpulse = kInfinity;
    return rows.back();
  }
  /// B's anchor moves along `direction`. The lever of A reaches to B's anchor, so that the axis of
  /// a slider rotates with A.
  JointRow& addLinearRow(const PlacedJoint& at, const Vec3& direction, const Vec3& reachA) {
    JointRow& row = addRow();
    row.linear = direction;
    row.angularA = reachA.cross(direction), row.angularB = at.armB.cross(direction);
    row.error = at.anchorOffset.dot(direction);
    return row;
  }
  JointRow& addAngularRow(const Vec3& direction, double error) {
    JointRow& row = addRow();
    row.angularA = row.angularB = direction;
    row.error = error;
    return row;
  }
};

void setLimitRow(JointRow& row, double distance) {
  row.kind = JointRow::Kind::limit;
  row.error = distance;
  row.minImpulse = 0;
}

void setMotorRow(JointRow& row, const Joint& joint, double seconds) {
  row.kind = JointRow::Kind::motor;
  row.motorSpeed = joint.motorSpeed;
  row.minImpulse = -joint.maxMotorForce * seconds, row.maxImpulse = joint.maxMotorForce * seconds;
}

/// Sine and cosine of the joint angle minus a limit angle, valid up to a quarter turn.
struct AngleFromLimit {
  double sine, cosine;
};
AngleFromLimit computeAngleFrom(const PlacedJoint& at, double radians) {
  const double cosine = at.perpendicularA.dot(at.perpendicularB);
  const double sine = at.axis.dot(at.perpendicularA.cross(at.perpendicularB));
  const Vec3 limitDirection =
      makeHeadingFromDegrees(radians * kDegreesPerRadian);  // (cos, 0, -sin)
  const double limitCosine = limitDirection.x(), limitSine = -limitDirection.z();
  return {sine * limitCosine - cosine * limitSine, cosine * limitCosine + sine * limitSine};
}

void appendHingeRows(const Joint& joint, const PlacedJoint& at, double seconds, RowWriter writer) {
  for (int k = 0; k < 3; ++k) writer.addLinearRow(at, Vec3::Unit(k), at.armA);
  const Vec3 tilt = at.axis.cross(at.axisB);
  writer.addAngularRow(at.perpendicular1, tilt.dot(at.perpendicular1));
  writer.addAngularRow(at.perpendicular2, tilt.dot(at.perpendicular2));
  if (joint.maxMotorForce > 0) setMotorRow(writer.addAngularRow(at.axis, 0), joint, seconds);
  if (!joint.hasLimits) return;
  writer.slot = 6;
  const AngleFromLimit fromLower = computeAngleFrom(at, joint.lower),
                       fromUpper = computeAngleFrom(at, joint.upper);
  if (fromLower.cosine > 0) setLimitRow(writer.addAngularRow(at.axis, 0), fromLower.sine);
  writer.slot = 7;
  if (fromUpper.cosine > 0) setLimitRow(writer.addAngularRow(-at.axis, 0), -fromUpper.sine);
}

void appendSliderRows(const Joint& joint, const PlacedJoint& at, double seconds, RowWriter writer) {
  const Vec3 reachA = at.armA + at.anchorOffset;
  writer.addLinearRow(at, at.perpendicular1, reachA);
  writer.addLinearRow(at, at.perpendicular2, reachA);
  const Vec3 rotationError =
      0.5 * (at.axis.cross(at.axisB) + at.perpendicularA.cross(at.perpendicularB) +
             at.perpendicular2.cross(at.axisB.cross(at.perpendicularB)));
  for (int k = 0; k < 3; ++k) writer.addAngularRow(Vec3::Unit(k), rotationError[k]);
  const double position = at.anchorOffset.dot(at.axis);
  if (joint.maxMotorForce > 0)
    setMotorRow(writer.addLinearRow(at, at.axis, reachA), joint, seconds);
  if (!joint.hasLimits) return;
  writer.slot = 6;
  setLimitRow(writer.addLinearRow(at, at.axis, reachA), position - joint.lower);
  setLimitRow(writer.addLinearRow(at, -at.axis, reachA), joint.upper - position);
}

}  // namespace

Joint makeJoint(Joint::Kind kind, std::span<const BodyMotion> motions, std::uint32_t a,
                std::uint32_t b, const Vec3& point, const Vec3& axis) {
  ENFILADE_ASSERT(a != b && a < motions.size() && b < motions.size());
  const Mat3 aFromWorld = motions[a].rotation.toRotationMatrix().transpose();
  const Mat3 bFromWorld = motions[b].rotation.toRotationMatrix().transpose();
  Joint joint;
  joint.kind = kind;
  joint.a = a, joint.b = b;
  joint.anchorA = aFromWorld * (point - motions[a].centre);
  joint.anchorB = bFromWorld * (point - motions[b].centre);
  const Vec3 unit = axis.normalized(), perpendicular = computePerpendicular(unit);
  joint.axisA = aFromWorld * unit, joint.axisB = bFromWorld * unit;
  joint.perpendicularA = aFromWorld * perpendicular,
  joint.perpendicularB = bFromWorld * perpendicular;
  return joint;
}

void appendJointRows(const Joint& joint, std::uint32_t index, std::span<const BodyMotion> motions,
                     double seconds, std::vector<JointRow>& rows) {
  const PlacedJoint at(joint, motions[joint.a], motions[joint.b]);
  if (joint.kind == Joint::Kind::hinge) {
    appendHingeRows(joint, at, seconds, {rows, index});
  } else {
    appendSliderRows(joint, at, seconds, {rows, index});
  }
}

}  // namespace enfilade::scene
