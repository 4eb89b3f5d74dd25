// Mass, centre and inertia of solids of uniform density, from their surfaces.
#pragma once

#include <span>

#include "collision/shapes/hull.hpp"
#include "collision/shapes/triangle_tree.hpp"

namespace enfilade::scene {

using collision::Mat3;
using collision::Vec3;

struct MassProperties {
  double volume = 0;            ///< m^3, > 0
  double mass = 0;              ///< kg, > 0
  Vec3 centre = Vec3::Zero();   ///< of mass, in the frame of the vertices, metres
  Mat3 inertia = Mat3::Zero();  ///< about the centre, in the axes of that frame, kg m^2
};

/// Of a closed mesh whose triangles run anticlockwise seen from outside. `density` in kg / m^3.
/// Throws std::invalid_argument where that is not > 0 and finite, or the mesh holds no volume
/// (flat, open on average, or inside out).
MassProperties massOfMesh(std::span<const collision::Triangle> triangles, double density);

/// The same of a convex hull.
MassProperties massOfHull(const collision::Hull& hull, double density);

/// Of several solids that do not overlap (where they do, what they share counts twice).
MassProperties together(std::span<const MassProperties> parts);

/// The same body with another mass (kg, > 0 and finite; std::invalid_argument otherwise).
MassProperties withMass(MassProperties properties, double mass);

}  // namespace enfilade::scene
