// Motion state of one rigid body, and its integration without contacts.
#pragma once

#include "collision/floating_point.hpp"
#include "scene/model/shapes/mass_properties.hpp"

namespace enfilade::scene {

using collision::Quat;

using collision::kRoundUpFactor;

/// State and mass properties of a rigid body. World frame; metres, seconds, kilograms.
struct BodyMotion {
  Vec3 centre = Vec3::Zero();           ///< centre of mass
  Quat rotation = Quat::Identity();     ///< worldFromBody, unit
  Vec3 velocity = Vec3::Zero();         ///< of the centre, m/s
  Vec3 angularVelocity = Vec3::Zero();  ///< rad/s
  double inverseMass = 0;               ///< 1/kg; 0: impulses do not move the body
  Mat3 inertia = Mat3::Zero();  ///< about the centre of mass, body axes; zero if inverseMass is 0
  Mat3 inverseInertia = Mat3::Zero();  ///< body axes; zero if inverseMass is 0
  double friction = 0.5;               ///< Coulomb coefficient, >= 0; a pair uses sqrt(a b)
  double restitution = 0;              ///< 0..1; a pair uses the larger one
};

/// Advances the pose by `seconds` with constant velocities. The rotation uses the Cayley map,
/// (1, w t / 2) normalised. It rotates by 2 atan(|w| t / 2), which is less than |w| t by its cube.
void integratePose(BodyMotion& motion, double seconds);

/// Applies the gyroscopic torque, w x (I w), to the angular velocity. The integration is implicit:
/// it is stable at any angular velocity, and the kinetic energy never grows.
void applyGyroscopicTorque(BodyMotion& motion, double seconds);

/// Inverse inertia in world axes, 1/(kg m^2).
Mat3 computeWorldInverseInertia(const BodyMotion& motion);

}  // namespace enfilade::scene
