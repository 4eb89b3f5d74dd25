#include "scene/model/rotation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace enfilade::scene {
namespace {

TEST(Heading, QuarterTurnsAreExact) {
  EXPECT_EQ(makeHeadingFromDegrees(0), collision::Vec3(1, 0, 0));
  EXPECT_EQ(makeHeadingFromDegrees(90), collision::Vec3(0, 0, -1));
  EXPECT_EQ(makeHeadingFromDegrees(-90), collision::Vec3(0, 0, 1));
  EXPECT_EQ(makeHeadingFromDegrees(720), collision::Vec3(1, 0, 0));
}

TEST(Heading, AgreesWithTheMathLibraryAndHasUnitLength) {
  for (double degrees = -1000; degrees < 1000; degrees += 0.37) {
    const collision::Vec3 h = makeHeadingFromDegrees(degrees);
    const double radians = degrees * std::numbers::pi / 180;
    EXPECT_NEAR(h.x(), std::cos(radians), 1e-14) << degrees;
    EXPECT_NEAR(h.z(), -std::sin(radians), 1e-14) << degrees;
    EXPECT_NEAR(h.norm(), 1, 4e-16) << degrees;
  }
}

}  // namespace
}  // namespace enfilade::scene
