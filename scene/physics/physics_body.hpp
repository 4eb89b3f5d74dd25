// Rigid bodies of the physics world: convex parts that are dynamic, kinematic or static.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "collision/motion/interpolated_motion.hpp"
#include "collision/shapes/triangle_tree.hpp"
#include "scene/model/shapes/collision_geometry.hpp"
#include "scene/physics/body_motion.hpp"

namespace enfilade::scene {

/// A part of a body. The vertices are in the body frame and owned elsewhere.
struct ConvexPart : collision::ConvexShape {
  std::vector<Vec3> faceNormals;  ///< outward unit normals of the hull's faces
};

/// Makes a part of a hull, which must outlive the part.
ConvexPart makeConvexPart(const collision::Hull& hull);

/// Velocity of a kinematic body in one substep.
struct SubstepVelocity {
  Vec3 velocity = Vec3::Zero();         ///< of the centre of mass, m/s
  Vec3 angularVelocity = Vec3::Zero();  ///< rad/s
};

/// One body of the physics world.
struct PhysicsBody {
  /// Owns the hull of an avatar's part. All other hulls outlive the world.
  std::shared_ptr<const collision::Hull> hull;
  BodyMotion motion;                  ///< inverseMass 0: kinematic or static
  Vec3 centreInFrame = Vec3::Zero();  ///< centre of mass in the frame of the parts
  std::vector<ConvexPart> parts;
  /// Of a static body: its triangles are parts too, numbered after `parts`.
  const collision::TriangleTree* mesh = nullptr;
  double radius = 0;               ///< metres about the centre of mass: bound of all vertices
  bool asleep = false;             ///< a dynamic body that stays at rest until it is woken
  double sleepTimer = 0;           ///< seconds near the rest pose
  Vec3 restCentre = Vec3::Zero();  ///< where the timer began
  collision::Quat restRotation = collision::Quat::Identity();
  /// Motor of an avatar that pushes. The avatar counts as static and accelerates bodies in its way
  /// to this velocity, with up to `maxPushForce` newtons. 0: no motor.
  Vec3 targetVelocity = Vec3::Zero();
  double maxPushForce = 0;
  /// Metres: bound of the displacement of any point in a step. The broad phase covers no more.
  double maxStepDisplacement = std::numeric_limits<double>::infinity();
  /// One velocity for each solver substep, for a kinematic body that reverses within a step; else
  /// empty. `motion` holds their mean, and the swept path is taken as straight.
  std::vector<SubstepVelocity> substepVelocities;
  /// m/s: bound of the speed that a kinematic body can add by pushing in this step
  double pushSpeedBound = 0;
  /// bodies in contact with it do not sleep: it moves without being kinematic
  bool preventsSleep = false;

  // Set by updateTransform() from `motion`.
  Mat3 rotation = Mat3::Identity();
  Vec3 position = Vec3::Zero();  ///< of the frame's origin
  double accumulatedMotion =
      0;  ///< metres: bound of the displacement of any point, summed over all steps
  double teleportedDistance = 0;  ///< metres: bound of the displacement by teleports, summed

  bool isDynamic() const { return motion.inverseMass > 0; }
  bool isAwake() const { return isDynamic() && !asleep; }
  /// Kinematic and moving, or an avatar that pushes.
  bool isActuated() const {
    return !isDynamic() &&
           (!substepVelocities.empty() || !motion.velocity.isZero(0) ||
            !motion.angularVelocity.isZero(0) || (maxPushForce > 0 && !targetVelocity.isZero(0)));
  }
  /// Moves on a prescribed path before the solver runs.
  bool isKinematic() const { return isActuated() && maxPushForce == 0; }
  /// m/s: bound of the difference between a point's speed and its mean motion.
  double maxVelocityDeviation() const {
    double deviation = pushSpeedBound;
    for (const SubstepVelocity& substepVelocity : substepVelocities)
      deviation =
          std::max(deviation,
                   (substepVelocity.velocity - motion.velocity).norm() +
                       (substepVelocity.angularVelocity - motion.angularVelocity).norm() * radius);
    return deviation;
  }
  /// m/s: bound of the mean speed of any point.
  double maxPointSpeed() const {
    return asleep ? 0 : motion.velocity.norm() + motion.angularVelocity.norm() * radius;
  }
};

/// Recomputes the world transform from `motion`.
void updateTransform(PhysicsBody& body);

/// Returns the motion of a stationary body.
collision::InterpolatedMotion makeStationaryMotion(const PhysicsBody& body);

inline collision::ConvexShape getPartShape(const PhysicsBody& body, std::uint32_t part) {
  if (part >= body.parts.size()) return {body.mesh->triangles()[part - body.parts.size()], nullptr};
  return body.parts[part];
}

/// Returns part `part` at the body's present pose.
inline collision::PlacedConvex placePart(const PhysicsBody& body, std::uint32_t part) {
  if (part >= body.parts.size())
    return {body.mesh->triangles()[part - body.parts.size()], body.position, nullptr, nullptr};
  const ConvexPart& p = body.parts[part];
  return {p.vertices, body.position, &body.rotation, p.hull};
}

/// Makes a static body of hulls and triangles about the parts' origin, in the part order of
/// CollisionGeometry. `parts` must outlive it.
PhysicsBody makeStaticBody(const CollisionGeometry& parts);

}  // namespace enfilade::scene
