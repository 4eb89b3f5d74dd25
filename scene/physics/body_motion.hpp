// A rigid body that moves: its state, and how it goes on when nothing touches it.
#pragma once

#include "collision/types.hpp"
#include "scene/model/shapes/mass_properties.hpp"

namespace enfilade::scene {

using collision::Quat;

/// World frame, metres, seconds, kilograms.
struct RigidBody {
  Vec3 centre = Vec3::Zero();          ///< of mass
  Quat rotation = Quat::Identity();    ///< worldFromBody, unit
  Vec3 velocity = Vec3::Zero();        ///< of the centre, m/s
  Vec3 spin = Vec3::Zero();            ///< rad/s
  double inverseMass = 0;              ///< 1/kg; 0: no impulse changes how it moves
  Mat3 inertia = Mat3::Zero();         ///< about the centre, body's axes; zero if inverseMass is
  Mat3 inverseInertia = Mat3::Zero();  ///< the same
  double friction = 0.5;               ///< Coulomb's coefficient, >= 0; of a pair: sqrt(a b)
  double restitution = 0;              ///< 0..1; of a pair: the greater one
};

/// A free body at rest whose frame's origin is at `worldFromBody`.
RigidBody freeBody(const MassProperties& properties, const collision::Pose& worldFromBody);

/// Goes on for `seconds` with its velocity and spin. The rotation advances by Cayley's rational
/// map, (1, spin t / 2) normalised, which turns by 2 atan(|spin| t / 2): less than |spin| t by its
/// cube.
void advance(RigidBody& body, double seconds);

/// How the spin changes when nothing acts: spin x (inertia spin) bends it. Implicit, so it is
/// stable at any spin, and the kinetic energy never grows.
void bendSpin(RigidBody& body, double seconds);

/// kg m^2 inverted, in the world's axes.
Mat3 worldInverseInertia(const RigidBody& body);

/// J, of the motion only; 0 for a body that impulses do not change.
double kineticEnergy(const RigidBody& body);

}  // namespace enfilade::scene
