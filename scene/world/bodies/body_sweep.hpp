// How far a body that moves and turns may go towards something else.
#pragma once

#include "collision/motion/shape_cast.hpp"
#include "scene/world/bodies/body.hpp"

namespace enfilade::scene {

/// A way between two places, made evenly: the origin of the body's frame moves by `move`, and the
/// body turns about it by `turn`.
struct BodyWay {
  collision::Mat3 rotation;   ///< worldFromBody at the start
  Vec3 position;              ///< of the origin of the body's frame at the start
  Vec3 move = Vec3::Zero();   ///< metres
  Vec3 axis = Vec3::UnitY();  ///< unit
  double turn = 0;            ///< radians
  collision::Mat3 rotationAt(double s) const;
  Vec3 positionAt(double s) const { return position + s * move; }
};

/// A part of a body (its vertices in the body's frame) that goes a way.
struct MovingPart {
  const collision::Hull& hull;
  const BodyWay& way;
};

struct BodySweep {
  double fraction = 1;         ///< 0..1 of the way that may be made
  bool stopped = false;        ///< by the other; else `fraction` is 1
  bool reached = false;        ///< stopped where it came to band.high; else the search was given up
  collision::Decision atStop;  ///< at `fraction`, from the body to the other; only when stopped
};

/// Moves a part along its way towards `other`, which stands. As for collision::sweep(): over what
/// is granted the two stay at least min(band.low, their distance at the start) apart, up to the
/// rounding of a turned pose, and a stop is at about band.high. Where they start nearer than
/// band.low, only what does not close in is granted.
BodySweep sweepTurning(const MovingPart& part, const collision::ConvexBody& other,
                       const collision::StoppingBand& band, QueryCount& count);

/// The same of two that go their ways at the same time.
BodySweep sweepTurning(const MovingPart& part, const MovingPart& other,
                       const collision::StoppingBand& band, QueryCount& count);

}  // namespace enfilade::scene
