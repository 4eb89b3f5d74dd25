#include "render/ambient_occlusion.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace enfilade::render {
namespace {

constexpr int kWidth = 161, kHeight = 121;  // odd: the last pixel has no neighbour

Camera makeOcclusionCamera() {
  Camera camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.pinhole = Pinhole{100, 100, 80, 60};
  return camera;
}

/// The remaining light of each pixel for a given depth image: depth in metres at (x, y), which are
/// in focal lengths from the centre.
std::vector<std::uint8_t> computeLight(const std::function<double(double, double)>& depth) {
  std::vector<float> depths;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      depths.push_back(static_cast<float>(depth((x + 0.5 - 80) / 100, (y + 0.5 - 60) / 100)));
  const AmbientOcclusion occlusion(depths, makeOcclusionCamera());
  std::vector<std::uint8_t> left(depths.size());
  for (int y = 0; y < kHeight; ++y)
    occlusion.computeRow(y, std::span(left).subspan(static_cast<std::size_t>(y) * kWidth, kWidth));
  return left;
}

int getPixel(const std::vector<std::uint8_t>& left, int x, int y) {
  return left[static_cast<std::size_t>(y * kWidth + x)];
}

/// A floor 1.5 m below the eye, in front of a wall 4 m ahead.
double computeCornerDepth(double, double y) {
  return std::min(4.0, y > 0 ? 1.5 / y : 1e9);
}

TEST(AmbientOcclusion, PlanesOfAnyOrientationHaveNone) {
  for (const double x : {0.0, 0.4, -0.6}) {
    for (const double y : {0.0, 0.5, -0.6}) {
      const auto left = computeLight([&](double u, double v) { return 3 / (1 + x * u + y * v); });
      EXPECT_EQ(left, std::vector<std::uint8_t>(left.size(), 255)) << x << ' ' << y;
    }
  }
}

TEST(AmbientOcclusion, ACornerIsDarkerThanAPointHalfAMetreAway) {
  const auto left = computeLight(computeCornerDepth);
  const int row = 60 + 37;  // where floor and wall meet
  for (const int x : {20, 80, 81, 140}) {
    EXPECT_LT(getPixel(left, x, row), 245) << x;
    EXPECT_EQ(getPixel(left, x, row - 16), 255) << x;
  }
}

TEST(AmbientOcclusion, ADistantForegroundLeavesNoOutlineOnTheWall) {
  const auto left = computeLight([](double x, double) { return std::abs(x) < 0.2 ? 1.0 : 6.0; });
  EXPECT_EQ(left, std::vector<std::uint8_t>(left.size(), 255));
}

TEST(AmbientOcclusion, ANearForegroundShadesTheWallWithoutABand) {
  const auto left = computeLight([](double x, double) { return std::abs(x) < 0.2 ? 3.8 : 4.0; });
  int before = getPixel(left, 103, 60);
  EXPECT_LT(before, 250);
  for (int x = 104; x < 125; ++x) {  // with distance the wall only becomes lighter
    EXPECT_GE(getPixel(left, x, 60), before - 2) << x;
    before = getPixel(left, x, 60);
  }
  EXPECT_EQ(before, 255);
  for (int x = 101; x < 125; ++x) {  // no pattern of the sample offsets is visible
    for (int y = 50; y < 70; ++y)
      EXPECT_NEAR(getPixel(left, x, y), getPixel(left, x, 60), 3) << x << ' ' << y;
  }
}

TEST(AmbientOcclusion, WhereNothingIsSeenThereAreNone) {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  const auto left =
      computeLight([&](double x, double y) { return x > 0 ? kNothing : computeCornerDepth(x, y); });
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 80; x < kWidth; ++x) EXPECT_EQ(getPixel(left, x, y), 255) << x << ' ' << y;
  }
  EXPECT_LT(getPixel(left, 40, 97), 245);
}

TEST(AmbientOcclusion, GlassBeforeThemHidesThemAsFarAsItIsSeen) {
  const std::uint8_t colour[3] = {200, 100, 0};
  std::uint8_t bare[3], half[3], hidden[3];
  applyAo(colour, 153, 255, bare);
  applyAo(colour, 153, 128, half);
  applyAo(colour, 153, 0, hidden);
  EXPECT_EQ(bare[0], 120);
  EXPECT_NEAR(half[0], 160, 1);
  EXPECT_EQ(hidden[0], 200);
  EXPECT_EQ(bare[2], 0);
}

}  // namespace
}  // namespace enfilade::render
