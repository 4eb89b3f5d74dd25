#include "scene/avatar_hull.hpp"

#include <array>
#include <cmath>

namespace enfilade::scene {
namespace {

constexpr double kInset = 0.25;            // of the radius: how far the bevel goes in
constexpr double kBevelOfInset = 2.0 / 3;  // height of the bevel: 34 degrees, which is walkable
constexpr double kBevelOfHeight = 0.1;     // at most, so that flat avatars keep a side

}  // namespace

collision::Hull avatarHull(double radius, double height) {
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
  const double bevel = std::min(kBevelOfInset * inset, kBevelOfHeight * height);
  const std::array<std::array<double, 2>, 4> levels{
      {{0, radius - inset}, {bevel, radius}, {height - bevel, radius}, {height, radius - inset}}};
  std::vector<collision::Vec3> points;
  for (const auto& [y, r] : levels)
    for (const auto& [x, z] : ring) points.emplace_back(r * x, y, r * z);
  return collision::buildHull(points);
}

}  // namespace enfilade::scene
