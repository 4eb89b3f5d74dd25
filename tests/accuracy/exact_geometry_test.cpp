// Tests the exact reference on cases with known answers.
#include "tests/accuracy/exact_geometry.hpp"

#include <gtest/gtest.h>

namespace enfilade::accuracy {
namespace {

const std::vector<Vec3> kCube{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                              {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};

ReferenceResult computeReference(const Placed& a, const Placed& b) {
  return computeReferenceResult(makeExactPair(a, b));
}

Placed makeCubeAt(double x, double y, double z) {
  return {kCube, Mat3::Identity(), {x, y, z}};
}

TEST(ExactReference, TwoCubesApartAreApartByTheDiagonalBetweenTheirCorners) {
  const ReferenceResult answer = computeReference(makeCubeAt(0, 0, 0), makeCubeAt(4, 5, 13));
  EXPECT_EQ(answer.verdict, ReferenceVerdict::separated);
  EXPECT_EQ(answer.distance, 13);  // 3, 4, 12
}

TEST(ExactReference, AFaceOnAFaceTouches) {
  EXPECT_EQ(computeReference(makeCubeAt(0, 0, 0), makeCubeAt(1, 0.5, 0.25)).verdict,
            ReferenceVerdict::touching);
}

TEST(ExactReference, AnUlpDecides) {
  EXPECT_EQ(computeReference(makeCubeAt(0, 0, 0), makeCubeAt(1 + 0x1p-52, 0, 0)).distance, 0x1p-52);
  EXPECT_EQ(computeReference(makeCubeAt(0, 0, 0), makeCubeAt(1 - 0x1p-53, 0, 0)).depth, 0x1p-53);
}

TEST(ExactReference, TheDepthIsTheShortestWayOut) {
  const ReferenceResult answer = computeReference(makeCubeAt(0, 0, 0), makeCubeAt(0.5, 0.25, 0.75));
  EXPECT_EQ(answer.verdict, ReferenceVerdict::penetrating);
  EXPECT_EQ(answer.depth, 0.25);
}

TEST(ExactReference, OverlappingPolygonsInOnePlaneTouchAndASegmentThroughOnePenetrates) {
  const Placed square{{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}};
  const Placed inside{{{0.5, 0.5, 0}, {1, 0.5, 0}, {1, 1, 0}}};
  const Placed needle{{{1, 1, -1}, {1, 1, 3}}};
  EXPECT_EQ(computeReference(square, inside).verdict, ReferenceVerdict::touching);
  EXPECT_EQ(computeReference(square, needle).depth, 1);
}

TEST(ExactReference, ARotationIsNotNormalized) {
  Placed sheared = makeCubeAt(0, 0, 0);
  sheared.rotation(0, 0) = 1 + 0x1p-40;
  EXPECT_EQ(computeReference(sheared, makeCubeAt(1, 0, 0)).depth, 0x1p-40);
}

TEST(ExactReference, PointsAreCheckedWithinTheTolerance) {
  const ExactPair pair =
      makeExactPair(makeCubeAt(0, 0, 0), makeCubeAt(0, 0, 0), {1 + 0x1p-50, 0.5, 0.5});
  EXPECT_TRUE(isWithinTolerance(pair.pointA, pair.a, pair.bits, 0x1p-50));
  EXPECT_FALSE(isWithinTolerance(pair.pointA, pair.a, pair.bits, 0x1.fffp-51));
}

}  // namespace
}  // namespace enfilade::accuracy
