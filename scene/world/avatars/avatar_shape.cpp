#include "scene/world/avatars/avatar_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace enfilade::scene {
namespace {

constexpr double kInset = 0.25;            // of the radius: how far the bevel goes in
constexpr double kBevelOfInset = 2.0 / 3;  // height of the bevel: 34 degrees
constexpr double kBevelOfHeight = 0.1;     // at most, so that flat avatars keep a side
constexpr double kBevelOfSlope = 0.98;     // at most, so that it is walkable whatever rounds

double tangentOf(double normalY) {
  return std::sqrt(std::max(0.0, 1 - normalY * normalY)) / normalY;
}

}  // namespace

AvatarPart placedPart(std::shared_ptr<const collision::Hull> hull, const Vec3& offset,
                      const Mat3& avatarFromHull) {
  AvatarPart part{std::move(hull), offset, avatarFromHull, !avatarFromHull.isIdentity(0), {}};
  for (const Vec3& v : part.hull->vertices) {
    const Vec3 turned = part.turned ? Vec3(avatarFromHull * v) : v;
    part.box.include(turned + offset);
  }
  return part;
}

std::shared_ptr<const AvatarShape> shapeOf(std::vector<AvatarPart> parts) {
  auto shape = std::make_shared<AvatarShape>();
  for (const AvatarPart& part : parts) shape->box.include(part.box);
  shape->parts = std::move(parts);
  return shape;
}

double bevelOf(double radius, double standing, const Lengths& lengths) {
  const double slope = std::min(kBevelOfInset, kBevelOfSlope * tangentOf(lengths.walkableNormalY));
  const double bevel = std::min(slope * kInset * radius, kBevelOfHeight * standing);
  return std::min(bevel, lengths.stepHeight);
}

std::shared_ptr<const AvatarShape> prismShape(double radius, double height, double standing,
                                              const Lengths& lengths) {
  collision::Hull hull = avatarHull(radius, height, bevelOf(radius, standing, lengths));
  return shapeOf({placedPart(std::make_shared<const collision::Hull>(std::move(hull)), Vec3::Zero(),
                             Mat3::Identity())});
}

collision::Hull avatarHull(double radius, double height, double bevel) {
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
  const double inset = kInset * radius;
  const std::array<std::array<double, 2>, 4> levels{
      {{0, radius - inset}, {bevel, radius}, {height - bevel, radius}, {height, radius - inset}}};
  std::vector<collision::Vec3> points;
  for (const auto& [y, r] : levels)
    for (const auto& [x, z] : ring) points.emplace_back(r * x, y, r * z);
  return collision::buildHull(points);
}

}  // namespace enfilade::scene
