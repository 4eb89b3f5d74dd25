// Shape casts of a body part that translates and rotates, by conservative advancement.
#pragma once

#include "collision/motion/shape_cast.hpp"
#include "scene/world/data/body.hpp"
#include "scene/world/data/tick_report.hpp"

namespace enfilade::scene {

/// Uniform motion between two poses: the body frame's origin moves by `translation`, and the body
/// rotates about it by `angle`.
struct ScrewMotion {
  collision::Mat3 rotation;         ///< worldFromBody at the start
  Vec3 position;                    ///< of the body frame's origin at the start
  Vec3 translation = Vec3::Zero();  ///< metres
  Vec3 axis = Vec3::UnitY();        ///< unit
  double angle = 0;                 ///< radians
  collision::Mat3 rotationAt(double s) const;
  Vec3 positionAt(double s) const { return position + s * translation; }
};

/// A body part (vertices in body frame) that performs a motion.
struct MovingPart {
  const collision::Hull& hull;
  const ScrewMotion& motion;
};

struct PartCastResult {
  double fraction = 1;             ///< 0..1 of the motion that is free
  bool stopped = false;            ///< stopped by the other shape; otherwise `fraction` is 1
  bool reachedRestOffset = false;  ///< stopped at distance contactOffset.rest; false: the iteration
                                   ///< limit was reached
  collision::SeparationResult separation;  ///< at `fraction`, from the part to the other shape;
                                           ///< valid if stopped
};

/// Casts a part along its motion against the stationary shape `other`. Contract as for collision
/// shape casts: up to `fraction` the two keep at least min(contactOffset.min, initial distance), up
/// to the rounding of a rotated pose. The part stops at about contactOffset.rest. If they start
/// closer than contactOffset.min, only motion that does not approach is granted.
PartCastResult castMovingPart(const MovingPart& part, const collision::PlacedConvex& other,
                              const collision::ContactOffset& contactOffset, QueryCount& count);

/// The same for two parts that move simultaneously.
PartCastResult castMovingParts(const MovingPart& part, const MovingPart& other,
                               const collision::ContactOffset& contactOffset, QueryCount& count);

}  // namespace enfilade::scene
