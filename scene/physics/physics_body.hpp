// What free bodies meet and are: rigid things of convex parts, free, driven or still.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/triangle_tree.hpp"
#include "scene/model/shapes/collision_geometry.hpp"
#include "scene/physics/body_motion.hpp"

namespace enfilade::scene {

/// Its vertices are in the solid's frame, and live elsewhere.
struct PartShape {
  std::span<const Vec3> vertices;
  const collision::Hull* hull = nullptr;  ///< of these vertices; null: at most three of them
};

struct SolidPart : PartShape {
  std::vector<Vec3> faceNormals;  ///< of the hull's faces, unit, outwards
};

/// The part of a hull, which has to outlive it.
SolidPart partOfHull(const collision::Hull& hull);

/// How what is driven moves in a substep.
struct Gait {
  Vec3 velocity = Vec3::Zero();  ///< of the centre, m/s
  Vec3 spin = Vec3::Zero();      ///< rad/s
};

struct Solid {
  /// Keeps the part of an avatar's; what all other parts point at outlives the world.
  std::shared_ptr<const collision::Hull> hull;
  RigidBody motion;                   ///< inverse mass 0: driven, or still
  Vec3 centreInFrame = Vec3::Zero();  ///< of mass, in the frame of the parts
  std::vector<SolidPart> parts;
  /// Of what is still: its triangles are parts too, numbered after the others.
  const collision::TriangleTree* mesh = nullptr;
  double radius = 0;    ///< metres about the centre: no vertex is farther
  bool asleep = false;  ///< a free body that stands until something wakes it
  double calmFor = 0;   ///< seconds
  /// Who pushes (an avatar) stands as a still thing, and gives what it is held back from by this
  /// velocity up to `mostPush` newtons. 0: no push.
  Vec3 pushVelocity = Vec3::Zero();
  double mostPush = 0;
  /// Metres: no point may go farther in a step, since what is there was not asked for.
  double leash = std::numeric_limits<double>::infinity();
  /// Of what is driven back and forth within a step: one for each of the solver's substeps, else
  /// none. `motion` has the mean of them, and its way is taken to be straight.
  std::vector<Gait> gaits;
  /// m/s: so much faster than it goes it may be pushed within the step.
  double pushed = 0;
  bool restless = false;  ///< who leans on it does not sleep: it goes without being driven

  // Set by placeSolid() from the motion.
  Mat3 rotation = Mat3::Identity();
  Vec3 position = Vec3::Zero();  ///< of the frame's origin
  double odometer = 0;           ///< metres that no point exceeded in all steps
  double jumped = 0;             ///< metres that no point exceeded when it was placed from outside

  bool isFree() const { return motion.inverseMass > 0; }
  bool isAwake() const { return isFree() && !asleep; }
  /// Driven, or somebody who pushes.
  bool isMoved() const {
    return !isFree() && (!gaits.empty() || !motion.velocity.isZero(0) || !motion.spin.isZero(0) ||
                         (mostPush > 0 && !pushVelocity.isZero(0)));
  }
  /// Goes its way before the solver.
  bool isDriven() const { return isMoved() && mostPush == 0; }
  /// m/s: no point of it, driven or pushed as it is, departs faster from its mean motion.
  double swing() const {
    double most = pushed;
    for (const Gait& gait : gaits)
      most = std::max(most, (gait.velocity - motion.velocity).norm() +
                                (gait.spin - motion.spin).norm() * radius);
    return most;
  }
  /// m/s: no point goes faster; in the mean.
  double fastest() const {
    return asleep ? 0 : motion.velocity.norm() + motion.spin.norm() * radius;
  }
};

void placeSolid(Solid& solid);

inline PartShape shapeOf(const Solid& solid, std::uint32_t part) {
  if (part >= solid.parts.size())
    return {solid.mesh->triangles()[part - solid.parts.size()], nullptr};
  return solid.parts[part];
}

/// Part `part` where the solid is.
inline collision::ConvexBody partOf(const Solid& solid, std::uint32_t part) {
  if (part >= solid.parts.size())
    return {solid.mesh->triangles()[part - solid.parts.size()], solid.position, nullptr, nullptr};
  const SolidPart& p = solid.parts[part];
  return {p.vertices, solid.position, &solid.rotation, p.hull};
}

/// A free solid of convex parts (hulls in one frame, uniform `density` in kg / m^3).
Solid freeSolid(std::span<const collision::Hull* const> hulls, double density,
                const collision::Pose& worldFromFrame);
/// The same, standing or driven: its centre is the frame's origin.
Solid heldSolid(std::span<const collision::Hull* const> hulls,
                const collision::Pose& worldFromFrame);
/// What is still: hulls and triangles about the parts' origin, numbered as ObjectParts does.
/// `parts` has to outlive it.
Solid stillSolid(const ObjectParts& parts);

}  // namespace enfilade::scene
