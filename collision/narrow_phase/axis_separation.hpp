// What one direction says of two convex bodies: cheaper than their distance, and proved.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"

namespace enfilade::collision {

struct Gap {
  double value = 0;     ///< metres, up to rounding: from A to B along the direction; negative where
                        ///< they overlap along it
  double proved = 0;    ///< metres: their distance is not less; minus infinity: nothing is proved
  VertexPair vertices;  ///< A's farthest along the direction, B's against it
};

/// `direction`: world, from A to B, unit up to a few roundings. In doubles where the bodies have
/// few vertices (each is looked at), by proved supports otherwise. What is not finite proves
/// nothing.
Gap gapAlong(const ConvexBody& a, const ConvexBody& b, const Vec3& direction);

}  // namespace enfilade::collision
