// The judge itself, on what is known without it.
#include "tests/accuracy/exact_geometry.hpp"

#include <gtest/gtest.h>

namespace enfilade::accuracy {
namespace {

const std::vector<Vec3> kCube{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                              {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};

TrueAnswer judge(const Placed& a, const Placed& b) {
  return trueAnswer(exactPair(a, b));
}

Placed cubeAt(double x, double y, double z) {
  return {kCube, Mat3::Identity(), {x, y, z}};
}

TEST(Judge, TwoCubesApartAreApartByTheDiagonalBetweenTheirCorners) {
  const TrueAnswer answer = judge(cubeAt(0, 0, 0), cubeAt(4, 5, 13));
  EXPECT_EQ(answer.verdict, TrueVerdict::separated);
  EXPECT_EQ(answer.distance, 13);  // 3, 4, 12
}

TEST(Judge, AFaceOnAFaceTouches) {
  EXPECT_EQ(judge(cubeAt(0, 0, 0), cubeAt(1, 0.5, 0.25)).verdict, TrueVerdict::touching);
}

TEST(Judge, AnUlpDecides) {
  EXPECT_EQ(judge(cubeAt(0, 0, 0), cubeAt(1 + 0x1p-52, 0, 0)).distance, 0x1p-52);
  EXPECT_EQ(judge(cubeAt(0, 0, 0), cubeAt(1 - 0x1p-53, 0, 0)).depth, 0x1p-53);
}

TEST(Judge, TheDepthIsTheShortestWayOut) {
  const TrueAnswer answer = judge(cubeAt(0, 0, 0), cubeAt(0.5, 0.25, 0.75));
  EXPECT_EQ(answer.verdict, TrueVerdict::penetrating);
  EXPECT_EQ(answer.depth, 0.25);
}

TEST(Judge, OverlappingPolygonsInOnePlaneTouchAndASegmentThroughOnePenetrates) {
  const Placed square{{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}};
  const Placed inside{{{0.5, 0.5, 0}, {1, 0.5, 0}, {1, 1, 0}}};
  const Placed needle{{{1, 1, -1}, {1, 1, 3}}};
  EXPECT_EQ(judge(square, inside).verdict, TrueVerdict::touching);
  EXPECT_EQ(judge(square, needle).depth, 1);
}

TEST(Judge, ARotationIsTakenAsItIs) {
  Placed sheared = cubeAt(0, 0, 0);
  sheared.rotation(0, 0) = 1 + 0x1p-40;
  EXPECT_EQ(judge(sheared, cubeAt(1, 0, 0)).depth, 0x1p-40);
}

TEST(Judge, APointIsWithinTheToleranceOfItsBodyOrNot) {
  const ExactPair pair = exactPair(cubeAt(0, 0, 0), cubeAt(0, 0, 0), {1 + 0x1p-50, 0.5, 0.5});
  EXPECT_TRUE(liesWithin(pair.pointA, pair.a, pair.bits, 0x1p-50));
  EXPECT_FALSE(liesWithin(pair.pointA, pair.a, pair.bits, 0x1.fffp-51));
}

}  // namespace
}  // namespace enfilade::accuracy
