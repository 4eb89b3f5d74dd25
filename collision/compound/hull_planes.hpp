// Face planes of a hull with proved error bounds, for depth-inside queries.
#pragma once

#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/triangle_tree.hpp"

namespace enfilade::collision {

/// Face planes of a hull in the body frame. Empty for a flat hull, which has no interior.
struct HullPlanes {
  struct Plane {
    Vec3 normal;    ///< unit up to rounding, outwards
    double height;  ///< normal . x < height proves that x lies inside the exact face plane, for all
                    ///< |x| <= 2 radius; lowered by the rounding error bound
    double support;  ///< normal . v <= support for all vertices v, exactly
  };
  std::vector<Plane> planes;
  double radius = 0;  ///< of the hull about the origin of its frame, metres
  bool initialized = false;

  HullPlanes() = default;
  explicit HullPlanes(const Hull& hull);
};

/// Radius (metres) of a ball around some point of `triangle` that lies in the body: a lower bound
/// of the depth. 0 if no ball is found; one may still exist. `planes` must be those of body.hull.
double computeInteriorClearance(const HullPlanes& planes, const PlacedConvex& body,
                                const Triangle& triangle);

}  // namespace enfilade::collision
