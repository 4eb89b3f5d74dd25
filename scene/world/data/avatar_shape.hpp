// The shape of an avatar: convex parts in the avatar's frame. Its origin is at the feet, its axes
// are the scene's. A prism does not rotate; other parts and the links of a chain do.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "collision/bounds/bounding_box.hpp"
#include "collision/floating_point.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/hull.hpp"
#include "scene/world/data/world_settings.hpp"

namespace enfilade::scene {

using collision::Aabb;
using collision::Mat3;
using collision::Vec3;

struct AvatarPart {
  std::shared_ptr<const collision::Hull> hull;
  Vec3 offset = Vec3::Zero();        ///< metres, of the hull's origin, avatar frame
  Mat3 rotation = Mat3::Identity();  ///< avatarFromHull
  bool rotated = false;              ///< `rotation` is not the identity
  Aabb box;                          ///< contains the placed hull, avatar frame
};

/// Work for the boxes of an avatar that turns or moves its joints, since the end of the last tick.
struct BoxWork {
  std::uint64_t verticesLookedAt = 0;
  std::uint64_t partBoxesMade = 0;
};

/// Immutable: an avatar that crouches or moves its joints gets a new shape.
struct AvatarShape {
  std::vector<AvatarPart> parts;  ///< at least one
  Aabb box;                       ///< of all parts
};

/// A hull that turns with the avatar or with a joint, and its way to a box.
struct TurningHull {
  std::shared_ptr<const collision::Hull> hull;
  collision::SupportTable support;           ///< of `hull`
  collision::ExtremalVertices lastExtremes;  ///< cost only
};

TurningHull makeTurningHull(collision::Hull hull, collision::AabbMethod method);

/// `turning` at a pose. Its box contains the exact one. Of `turning` only the extremal vertices
/// change.
AvatarPart placeTurningHull(TurningHull& turning, const Vec3& offset, const Mat3& avatarFromHull,
                            BoxWork& work);

/// A hull in the avatar's own frame, and its exact box.
AvatarPart makeAvatarPart(std::shared_ptr<const collision::Hull> hull);

std::shared_ptr<const AvatarShape> makeAvatarShape(std::vector<AvatarPart> parts);

/// Height of a prism's bevels, metres; at most a step. Their slope is walkable, so that an avatar
/// slides up a ledge on the lower one. Depends on the height at spawn, so that the prism of a
/// crouching avatar lies inside the full one.
double computeBevelHeight(double radius, double spawnHeight, const WorldSettings& settings);

/// A shape whose only part is a prism of twelve sides with bevels. The widest ring has the given
/// radius. Requires height >= spawnHeight / 4.
std::shared_ptr<const AvatarShape> makePrismShape(double radius, double height, double spawnHeight,
                                                  const WorldSettings& settings);

/// Height of the eyes above the feet for an avatar of this height, metres.
double computeEyeHeight(double height);

/// `box` of the avatar's frame in the scene's frame, for feet at `footPosition`; rounded. For
/// searches with a margin of a contact offset or more, which exceeds the rounding.
inline Aabb placeBox(const Aabb& box, const Vec3& footPosition) {
  return {box.min + footPosition, box.max + footPosition};
}

/// The same, rounded outwards: it contains the part as placeAvatarPart() places it. Let e be the
/// unit roundoff. Each side errs by e |box + foot|, its margin by as much again, and the
/// translation of the part by e |foot + offset|. computeAabb() has room for e |offset|. 4 e (|box|
/// + |foot|) covers the rest.
inline Aabb placeBoxOutward(const Aabb& box, const Vec3& footPosition) {
  const Vec3 sizes = box.min.cwiseAbs().cwiseMax(box.max.cwiseAbs()) + footPosition.cwiseAbs();
  const Vec3 margins = 4 * collision::kRoundoff * sizes;
  return {box.min + footPosition - margins, box.max + footPosition + margins};
}

/// A part in the scene's frame, for feet at `footPosition`. Points into `part`.
inline collision::PlacedConvex placeAvatarPart(const AvatarPart& part, const Vec3& footPosition) {
  return {part.hull->vertices, footPosition + part.offset, part.rotated ? &part.rotation : nullptr,
          part.hull.get()};
}

}  // namespace enfilade::scene
