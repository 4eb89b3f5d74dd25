// Tests of numbers, ranges and points in messages.
#include "scene/model/format_number.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace enfilade::scene {
namespace {

TEST(FormatNumber, ExactNumbersAreShortAndHaveNoExponent) {
  EXPECT_EQ(formatExactNumber(0.1), "0.1");
  EXPECT_EQ(formatExactNumber(1e7), "10000000");
  EXPECT_EQ(formatExactNumber(-0.5), "-0.5");
  EXPECT_EQ(formatExactNumber(1e-6), "0.000001");
  EXPECT_EQ(formatExactNumber(1e300), "1e+300");
  EXPECT_EQ(formatExactNumber(std::numeric_limits<double>::quiet_NaN()), "NaN");
}

TEST(FormatNumber, PointsAreRoundedAndReadable) {
  EXPECT_EQ(formatPoint({1.5, 300, -0.00001}), "[1.5, 300, 0]");
  EXPECT_EQ(formatPoint({0.12344, -2, 1e7}), "[0.1234, -2, 10000000]");
}

TEST(FormatNumber, RangesHaveTheUnitTwice) {
  EXPECT_EQ(formatRangeError("speed", 20, 0, 10, "m/s"), "speed is 20 m/s; give 0 to 10 m/s");
  EXPECT_EQ(formatRangeError("friction", -1, 0, 100, ""), "friction is -1; give 0 to 100");
}

}  // namespace
}  // namespace enfilade::scene
