// The shape of an avatar: convex parts at poses in its frame, whose origin is at the feet and whose
// axes are the world's. An avatar does not turn; only the links of a chain do.
#pragma once

#include <memory>
#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/hull.hpp"
#include "scene/world/data/world_settings.hpp"

namespace enfilade::scene {

using collision::Box;
using collision::Mat3;
using collision::Vec3;

struct AvatarPart {
  std::shared_ptr<const collision::Hull> hull;
  Vec3 offset = Vec3::Zero();        ///< metres, of the hull's origin in the avatar's frame
  Mat3 rotation = Mat3::Identity();  ///< avatarFromHull
  bool turned = false;               ///< `rotation` is not the identity
  Box box;                           ///< of the placed hull, in the avatar's frame
};

/// Never changed once made: an avatar that crouches or bends gets another one.
struct AvatarShape {
  std::vector<AvatarPart> parts;  ///< at least one
  Box box;                        ///< of all parts
};

/// `hull` placed in the avatar's frame, its box worked out.
AvatarPart placedPart(std::shared_ptr<const collision::Hull> hull, const Vec3& offset,
                      const Mat3& avatarFromHull);

std::shared_ptr<const AvatarShape> shapeOf(std::vector<AvatarPart> parts);

/// Metres: the height of a prism's bevels. They face up, or down, enough to be stood on, and are no
/// higher than a step: over the lower one an avatar glides up a ledge. They are those of an avatar
/// of `standing` metres, so that the prism of one who crouches lies inside the one who stands.
double bevelOf(double radius, double standing, const Lengths& lengths);

/// A bevelled prism on twelve sides: origin in the middle of the bottom, +Y up, metres; the widest
/// ring has the given radius. height >= standing / 4.
collision::Hull avatarHull(double radius, double height, double bevel);

/// One part: the prism.
std::shared_ptr<const AvatarShape> prismShape(double radius, double height, double standing,
                                              const Lengths& lengths);

/// The box of `box` in the avatar's frame when the feet are at `feet`.
inline Box boxAt(const Box& box, const Vec3& feet) {
  return {box.min + feet, box.max + feet};
}

/// The part of an avatar that stands at `feet`. It points into `part`.
inline collision::ConvexBody bodyAt(const AvatarPart& part, const Vec3& feet) {
  return {part.hull->vertices, feet + part.offset, part.turned ? &part.rotation : nullptr,
          part.hull.get()};
}

}  // namespace enfilade::scene
