// Mass, centre of mass and inertia of solids of uniform density, from their surfaces.
#pragma once

#include <span>

#include "collision/shapes/hull.hpp"

namespace enfilade::scene {

using collision::Mat3;
using collision::Vec3;

struct MassProperties {
  double volume = 0;            ///< m^3, > 0
  double mass = 0;              ///< kg, > 0
  Vec3 centre = Vec3::Zero();   ///< of mass, in the frame of the vertices, metres
  Mat3 inertia = Mat3::Zero();  ///< about the centre, in the axes of that frame, kg m^2
};

/// Mass properties of a convex hull. `density` in kg / m^3. Throws std::invalid_argument if the
/// density is not > 0 and finite, or if the hull encloses no volume.
MassProperties computeHullMass(const collision::Hull& hull, double density);

/// Sum of several solids that do not overlap (overlapping volume counts twice).
MassProperties combineMassProperties(std::span<const MassProperties> parts);

/// Scales to another mass (kg, > 0 and finite; std::invalid_argument otherwise).
MassProperties scaleToMass(MassProperties properties, double mass);

}  // namespace enfilade::scene
