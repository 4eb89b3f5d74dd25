// The face planes of a hull with proved error bounds: how deep inside is a point?
#pragma once

#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/triangle_tree.hpp"

namespace enfilade::collision {

/// In the body's frame. Empty for a flat hull, which has no inside.
struct HullPlanes {
  struct Plane {
    Vec3 normal;    ///< unit up to rounding, outwards
    double height;  ///< normal . x < height proves that x lies inside of the exact face, for all
                    ///< |x| <= 2 radius; lowered by all that rounding can do
    double most;    ///< normal . v <= most for all vertices v, exactly
  };
  std::vector<Plane> planes;
  double radius = 0;  ///< of the hull, about its frame's origin
  bool made = false;

  HullPlanes() = default;
  explicit HullPlanes(const Hull& hull);
};

/// A ball around some point of `triangle` lies in the body: its radius in metres. 0 when none is
/// found (there may be one all the same). `planes` are of body.hull.
double clearanceInside(const HullPlanes& planes, const ConvexBody& body, const Triangle& triangle);

}  // namespace enfilade::collision
