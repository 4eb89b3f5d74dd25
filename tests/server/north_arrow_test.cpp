// The arrow to north on plans: there only if the model knows it, and pointing there.
#include <gtest/gtest.h>

#include <algorithm>

#include "server/plans/plan_drawing.hpp"

namespace enfilade::server {
namespace {

constexpr render::Colour kPaper{255, 255, 255};

render::Image drawBar(const std::optional<Eigen::Vector2d>& north) {
  render::Canvas canvas(600, 120, kPaper);
  PlanView view;
  view.area = {scene::Vec3(0, 0, 0), scene::Vec3(5, 3, 5)};
  view.unitsPerMetre = 20;
  drawScaleBar(canvas, view, {10, 50}, north);
  return canvas.toImage();
}

/// The mean place of the pixels that the arrow changes, weighted by how much.
Eigen::Vector2d findArrow(const Eigen::Vector2d& north) {
  const render::Image with = drawBar(north), without = drawBar(std::nullopt);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weight = 0;
  for (std::size_t i = 0; i < with.rgb.size(); ++i) {
    const double change = std::abs(with.rgb[i] - without.rgb[i]);
    const std::size_t pixel = i / 3;
    sum += change *
           Eigen::Vector2d(static_cast<double>(pixel % 600), static_cast<double>(pixel / 600));
    weight += change;
  }
  EXPECT_GT(weight, 1000);
  return sum / weight;
}

TEST(NorthArrow, PointsToNorthOnThePage) {
  // The letter beyond the tip and the tail are on opposite sides. Turning the arrow by a half turn
  // moves the letter, so that the difference points to north.
  const Eigen::Vector2d up(0, -1), right(1, 0), slanted(0.6, -0.8);
  for (const Eigen::Vector2d& north : {up, right, slanted}) {
    const Eigen::Vector2d moved = findArrow(north) - findArrow(-north);
    EXPECT_GT(moved.normalized().dot(north), 0.8) << north.transpose();
  }
}

}  // namespace
}  // namespace enfilade::server
