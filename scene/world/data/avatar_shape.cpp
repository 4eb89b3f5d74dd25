#include "scene/world/data/avatar_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace enfilade::scene {
namespace {

constexpr double kBevelInset = 0.25;        // horizontal depth of the bevel, fraction of the radius
constexpr double kMaxBevelSlope = 2.0 / 3;  // height of the bevel per depth: 34 degrees
constexpr double kMaxBevelPerHeight = 0.1;  // maximum, so that low avatars keep vertical sides
constexpr double kWalkableSlopeMargin = 0.98;  // maximum, so that rounding keeps it walkable
constexpr double kEyeDepthBelowTop = 0.15;     // metres, at most a tenth of the height

double computeSlope(double normalY) {
  return std::sqrt(std::max(0.0, 1 - normalY * normalY)) / normalY;
}

/// A bevelled prism with twelve sides, metres: origin at the centre of the bottom, +Y up. The
/// widest ring has the given radius. Requires height >= spawnHeight / 4.
collision::Hull buildPrismHull(double radius, double height, double bevel) {
  // cos and sin of multiples of 30 degrees, exact up to the rounding of sqrt.
  const double s = std::sqrt(3.0) / 2;
  const std::array<std::array<double, 2>, 12> ring{{{1, 0},
                                                    {s, 0.5},
                                                    {0.5, s},
                                                    {0, 1},
                                                    {-0.5, s},
                                                    {-s, 0.5},
                                                    {-1, 0},
                                                    {-s, -0.5},
                                                    {-0.5, -s},
                                                    {0, -1},
                                                    {0.5, -s},
                                                    {s, -0.5}}};
  const double inset = kBevelInset * radius;
  const std::array<std::array<double, 2>, 4> levels{
      {{0, radius - inset}, {bevel, radius}, {height - bevel, radius}, {height, radius - inset}}};
  std::vector<collision::Vec3> points;
  for (const auto& [y, r] : levels)
    for (const auto& [x, z] : ring) points.emplace_back(r * x, y, r * z);
  return collision::buildHull(points);
}

}  // namespace

TurningHull makeTurningHull(collision::Hull hull, collision::AabbMethod method) {
  TurningHull turning;
  turning.support = collision::buildSupportTable(hull, method);
  turning.hull = std::make_shared<const collision::Hull>(std::move(hull));
  return turning;
}

AvatarPart placeTurningHull(TurningHull& turning, const Vec3& offset, const Mat3& avatarFromHull,
                            BoxWork& work) {
  ++work.partBoxesMade;
  const Aabb box = computeAabb(*turning.hull, turning.support, avatarFromHull, offset,
                               turning.lastExtremes, work.verticesLookedAt);
  return {turning.hull, offset, avatarFromHull, !avatarFromHull.isIdentity(0), box};
}

AvatarPart makeAvatarPart(std::shared_ptr<const collision::Hull> hull) {
  AvatarPart part;
  part.hull = std::move(hull);
  for (const Vec3& v : part.hull->vertices) part.box.include(v);
  return part;
}

std::shared_ptr<const AvatarShape> makeAvatarShape(std::vector<AvatarPart> parts) {
  auto shape = std::make_shared<AvatarShape>();
  for (const AvatarPart& part : parts) shape->box.include(part.box);
  shape->parts = std::move(parts);
  return shape;
}

double computeBevelHeight(double radius, double spawnHeight, const WorldSettings& settings) {
  const double slope =
      std::min(kMaxBevelSlope, kWalkableSlopeMargin * computeSlope(settings.walkableNormalY));
  const double bevel = std::min(slope * kBevelInset * radius, kMaxBevelPerHeight * spawnHeight);
  return std::min(bevel, settings.stepHeight);
}

std::shared_ptr<const AvatarShape> makePrismShape(double radius, double height, double spawnHeight,
                                                  const WorldSettings& settings) {
  collision::Hull hull =
      buildPrismHull(radius, height, computeBevelHeight(radius, spawnHeight, settings));
  return makeAvatarShape(
      {makeAvatarPart(std::make_shared<const collision::Hull>(std::move(hull)))});
}

double computeEyeHeight(double height) {
  return height - std::min(kEyeDepthBelowTop, 0.1 * height);
}

}  // namespace enfilade::scene
