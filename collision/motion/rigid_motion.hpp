// Motions of a rigid body over a fraction 0..1: a rotation about a line, and a uniform motion
// between two poses. A pure translation is a Vec3.
#pragma once

#include "collision/shapes/placed_convex.hpp"

namespace enfilade::collision {

/// worldFromBody.
struct RigidTransform {
  Mat3 rotation = Mat3::Identity();
  Vec3 translation = Vec3::Zero();  ///< metres
};

/// Rotation about a line, counter-clockwise seen against the axis.
struct AxisRotation {
  Vec3 pivot = Vec3::Zero();  ///< a point of the line, world, metres
  Vec3 axis = Vec3::UnitY();  ///< unit, world
  double angle = 0;           ///< radians, signed, at most a million
};

/// Uniform motion between two poses: the body frame's origin moves by `translation`, and the body
/// rotates about it by `angle`.
struct ScrewMotion {
  Mat3 rotation;                    ///< worldFromBody at the start
  Vec3 position;                    ///< of the body frame's origin at the start
  Vec3 translation = Vec3::Zero();  ///< metres
  Vec3 axis = Vec3::UnitY();        ///< unit
  double angle = 0;                 ///< radians
};

/// worldFromBody of `body` after `fraction` (0..1) of the rotation.
RigidTransform computeTransformAfter(const PlacedConvex& body, const AxisRotation& rotation,
                                     double fraction);

/// worldFromBody after `fraction` (0..1) of the motion.
RigidTransform computeTransformAfter(const ScrewMotion& motion, double fraction);

/// `shape` at a pose, which must outlive the result.
inline PlacedConvex place(const ConvexShape& shape, const RigidTransform& worldFromBody) {
  return {shape.vertices, worldFromBody.translation, &worldFromBody.rotation, shape.hull};
}

}  // namespace enfilade::collision
