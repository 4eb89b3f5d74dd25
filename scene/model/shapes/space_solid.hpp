// Point containment in the solid of a space, such as a room, and a point in its middle.
#pragma once

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Whether the solid contains the point (scene frame, metres).
bool isInSpace(const Space& space, const Vec3& point);

struct SpaceMiddle {
  Vec3 point = Vec3::Zero();  ///< scene frame, metres; at half the height of the space's box
  double width = 0;  ///< metres along x in the space, half of them on each side of the point
};

/// A point of a space that is not empty, for its name or as a goal. It is the centre of its box if
/// this is in the solid, otherwise about the point that is farthest from the walls. Only the part
/// in `area` counts, which overlaps the box. A surface without inside has the centre as well.
SpaceMiddle findSpaceMiddle(const Space& space, const Aabb& area);

}  // namespace enfilade::scene
