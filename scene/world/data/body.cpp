#include "scene/world/data/body.hpp"

#include <algorithm>
#include <cmath>

#include "scene/model/rotation.hpp"

namespace enfilade::scene {
namespace {

/// Relative rounding of a rotated and translated vertex: more than the four roundings that occur.
constexpr double kRelativeRounding = 0x1p-49;

Aabb computePartAabb(const collision::Hull& hull, const Body& body) {
  Aabb box;
  for (const Vec3& vertex : hull.vertices)
    box.include(body.isRotated ? Vec3(body.rotation * vertex + body.position)
                               : Vec3(vertex + body.position));
  const double extent = 2 * hull.radius + body.position.cwiseAbs().maxCoeff();
  return inflated(box, kRelativeRounding * extent);
}

/// Joint pose of a path at a time between its first key and its last.
JointPose interpolatePath(const std::vector<PathKey>& keys, double time) {
  const auto after = std::upper_bound(keys.begin() + 1, keys.end() - 1, time,
                                      [](double t, const PathKey& key) { return t < key.time; });
  const PathKey &a = *(after - 1), &b = *after;
  return interpolateJointPose({a.offset, a.angle}, {b.offset, b.angle},
                              (time - a.time) / (b.time - a.time));
}

}  // namespace

void setBodyPose(Body& body, const Vec3& position, const collision::Quat& orientation) {
  body.position = position;
  body.orientation = orientation;
  body.rotation = orientation.toRotationMatrix();
  body.isRotated = body.rotation != collision::Mat3::Identity();
  const auto& parts = body.shape->parts;
  body.partBoxes.resize(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i)
    body.partBoxes[i] = computePartAabb(parts[i], body);
}

collision::PlacedConvex makePlacedPart(const Body& body, std::uint32_t part) {
  const collision::Hull& hull = body.shape->parts[part];
  return {hull.vertices, body.position, body.isRotated ? &body.rotation : nullptr, &hull};
}

Aabb computeAabb(const Body& body) {
  Aabb box;
  for (const Aabb& part : body.partBoxes) box.include(part);
  return box;
}

collision::Pose computeBodyPose(const BodySpec& spec, const JointPose& jointPose) {
  return {makeAxisRotation(spec.axis, jointPose.angle).normalized(),
          spec.anchor + jointPose.offset};
}

JointPose computeJointPose(const BodySpec& spec, double jointPosition) {
  switch (spec.kind) {
    case BodyKind::hinged:
      return {Vec3::Zero(), jointPosition};
    case BodyKind::path:
      return interpolatePath(spec.keys, jointPosition);
    case BodyKind::sliding:
    case BodyKind::lift:
    case BodyKind::rigid:    // position 0
    case BodyKind::trigger:  // position 0
      return {jointPosition * spec.axis, 0};
  }
  return {};
}

collision::Pose computeStartPose(const BodySpec& spec) {
  return computeBodyPose(spec, computeJointPose(spec, 0));
}

JointPose interpolateJointPose(const JointPose& from, const JointPose& to, double s) {
  return {from.offset + s * (to.offset - from.offset), from.angle + s * (to.angle - from.angle)};
}

double computeDisplacementBound(const BodyShape& shape, const JointPose& from,
                                const JointPose& to) {
  return (to.offset - from.offset).norm() + std::abs(to.angle - from.angle) * shape.radius;
}

}  // namespace enfilade::scene
