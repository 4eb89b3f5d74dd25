#include "scene/world/data/body.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "scene/model/rotation.hpp"

namespace enfilade::scene {
namespace {

/// Joint pose of a path at a time between its first key and its last.
JointPose interpolatePath(const std::vector<PathKey>& keys, double time) {
  const auto after = std::upper_bound(keys.begin() + 1, keys.end() - 1, time,
                                      [](double t, const PathKey& key) { return t < key.time; });
  const PathKey &a = *(after - 1), &b = *after;
  return interpolateJointPose({a.offset, a.angle}, {b.offset, b.angle},
                              (time - a.time) / (b.time - a.time));
}

void updateWholeBox(Body& body) {
  const BodyShape& shape = *body.shape;
  BodyBoxes& boxes = body.boxes;
  const bool isSingle = shape.parts.size() == 1;
  const std::size_t outline = isSingle ? 0 : shape.parts.size();
  boxes.parts.resize(shape.parts.size());
  boxes.last.resize(outline + 1);
  boxes.whole = computeAabb(isSingle ? shape.parts[0] : shape.outline,
                            isSingle ? shape.partSupports[0] : shape.outlineSupport, body.rotation,
                            body.position, boxes.last[outline], boxes.verticesLookedAt);
  boxes.hasParts = isSingle;
  if (isSingle) boxes.parts[0] = boxes.whole;
}

}  // namespace

void setBodyPose(Body& body, const Vec3& position, const collision::Quat& orientation) {
  body.position = position;
  body.orientation = orientation;
  body.rotation = orientation.toRotationMatrix();
  body.isRotated = body.rotation != collision::Mat3::Identity();
  updateWholeBox(body);
}

void placeBody(Body& body, const collision::Pose& pose) {
  setBodyPose(body, pose.translation, pose.rotation);
  body.motionBounds = body.boxes.whole;
}

void makePartBoxes(Body& body) {
  BodyBoxes& boxes = body.boxes;
  if (boxes.hasParts) return;
  for (std::uint32_t part = 0; part < getPartCount(body); ++part)
    boxes.parts[part] =
        computeAabb(body.shape->parts[part], body.shape->partSupports[part], body.rotation,
                    body.position, boxes.last[part], boxes.verticesLookedAt);
  boxes.partBoxesMade += boxes.parts.size();
  boxes.hasParts = true;
}

Aabb getPartBox(const Body& body, std::uint32_t part) {
  ENFILADE_ASSERT(part < getPartCount(body));
  if (body.boxes.hasParts) return body.boxes.parts[part];
  collision::ExtremalVertices last = body.boxes.last[part];
  std::uint64_t looked = 0;
  return computeAabb(body.shape->parts[part], body.shape->partSupports[part], body.rotation,
                     body.position, last, looked);
}

collision::PlacedConvex makePlacedPart(const Body& body, std::uint32_t part) {
  const collision::Hull& hull = body.shape->parts[part];
  return {hull.vertices, body.position, body.isRotated ? &body.rotation : nullptr, &hull};
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
