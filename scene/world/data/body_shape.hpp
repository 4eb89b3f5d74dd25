// The collision shape and mass properties of a body, in the body's frame. Built once per scene;
// shared by worlds and bodies.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "collision/bounds/bounding_box.hpp"
#include "collision/compound/compound_view.hpp"
#include "collision/shapes/hull.hpp"
#include "scene/model/model.hpp"
#include "scene/model/shapes/shape.hpp"

namespace enfilade::scene {

struct BodyShape {
  /// Kinematic bodies: a hull per closed convex shell, otherwise one hull of three vertices per
  /// triangle. Rigid bodies and triggers: the convex hull of each connected piece.
  std::vector<collision::Hull> parts;
  /// Of `parts`, for their boxes. Those of several parts are tight, as `tree` is.
  std::vector<collision::SupportTable> partSupports;
  /// Convex hull of all parts and its support table, for the box of the body; not set with one
  /// part.
  collision::Hull outline;
  collision::SupportTable outlineSupport;
  Vec3 origin = Vec3::Zero();   ///< of the body's frame as authored, scene frame, metres
  collision::BoxTree tree;      ///< over `parts`, body frame
  Aabb box;                     ///< of all parts, body frame
  double radius = 0;            ///< upper bound of a vertex's distance from the origin, metres
  std::uint32_t hullCount = 0;  ///< number of parts that are solids or flat polygons
  /// Number of pieces replaced by a hull that is larger than the piece. 0: exact.
  std::uint32_t approximateCount = 0;

  // Rigid bodies only: the parts as solids of uniform density. Overlaps count twice.
  double volume = 0;  ///< cubic metres, > 0; for flat shapes of the box, >= 1 mm thick
  double mass = 0;    ///< kilograms
  /// kg m^2, about the centre of mass (the body's origin), body axes.
  collision::Mat3 inertia = collision::Mat3::Identity();
};

/// Cache of shapes, keyed by a list of indices into Model::meshes.
using MeshShapeCache = std::map<std::vector<std::uint32_t>, Shape>;

/// Builds the shape of a body that validateBodies() accepts. `cache` holds shapes of the same
/// model; missing ones are added. Throws std::invalid_argument with the body's name if no triangle
/// of its objects has an area.
BodyShape buildBodyShape(const Model& model, const BodySpec& spec, MeshShapeCache& cache);

/// Maps a point of the model to where the body at this pose has it.
Eigen::Affine3d computeWorldFromAuthored(const BodyShape& shape,
                                         const collision::Pose& worldFromBody);

/// The parts of `shape` at a pose. Points into `shape`, which must outlive the result.
collision::CompoundView makeCompoundView(const BodyShape& shape,
                                         const collision::Pose& worldFromBody);

}  // namespace enfilade::scene
