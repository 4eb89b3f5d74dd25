// The shape of a body: convex parts in the body's frame, and how its mass lies in it. Made once a
// scene; worlds and bodies share it.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "collision/compound/compound_distance.hpp"
#include "collision/shapes/hull.hpp"
#include "scene/model/model.hpp"
#include "scene/model/shapes/shape.hpp"

namespace enfilade::scene {

struct BodyShape {
  /// Solids for closed convex pieces, else triangles (a hull of three vertices); rigid bodies and
  /// triggers take the hull of each connected piece.
  std::vector<collision::Hull> parts;
  Vec3 origin = Vec3::Zero();  ///< of the body's frame, in the scene's, where it was authored
  collision::BoxTree tree;     ///< over the parts, body's frame
  Box box;                     ///< of all parts, body's frame
  double radius = 0;           ///< greatest distance of a vertex from the origin; not below it
  std::uint32_t hulls = 0;     ///< of the parts, those that are solids or flat polygons
  /// Pieces that a hull stands for although it is larger than they are. 0: exact.
  std::uint32_t approximate = 0;

  // Of rigid bodies: the parts as solids of one density (overlaps count twice).
  double volume = 0;  ///< cubic metres; > 0, else the box's, a millimetre thick at least
  double mass = 0;    ///< kilograms
  /// kg m^2 about the origin, the centre of mass, axes of the body's frame.
  collision::Mat3 inertia = collision::Mat3::Identity();
};

/// What lists of meshes are made of (indices into Model::meshes).
using ShapesOfMeshes = std::map<std::vector<std::uint32_t>, Shape>;

/// Of a body that refusalOfBodies() has nothing against. `known`: of the same model; what is not
/// there is added. Throws std::invalid_argument, naming the body, when its objects have no triangle
/// with an area.
BodyShape shapeOf(const Model& model, const BodySpec& spec, ShapesOfMeshes& known);

/// Its parts where a body of this shape stands at a pose. Points into the shape.
collision::TreeOfParts treeAt(const BodyShape& shape, const collision::Pose& worldFromBody);

}  // namespace enfilade::scene
