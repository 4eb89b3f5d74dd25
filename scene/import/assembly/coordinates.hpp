// Coordinates of imported models: up axis, distance and precision.
#pragma once

#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Metres from the origin; beyond this, floats no longer resolve a millimetre.
inline constexpr double kMaxPreciseDistance = 1000;
/// Metres between neighbouring floats; beyond it, a diagnostic.
inline constexpr double kMaxFloatSpacing = 1e-4;

/// Rotates the up axis to Y, by a quarter turn about the third axis; -y by a half turn about x.
Eigen::Matrix3d makeYUpRotation(UpAxis up);

/// The box of an object's triangles in the frame that `frameFromMesh` leads to.
Aabb computeObjectAabb(const Model& model, const Object& object,
                       const Eigen::Affine3d& frameFromMesh);

/// Adds `offset` (metres, world) to the placement of an object, if that is known.
void movePlacement(Object& object, const Vec3& offset);

/// The upper median of at least one value.
double computeMedian(std::vector<double> values);

}  // namespace enfilade::scene
