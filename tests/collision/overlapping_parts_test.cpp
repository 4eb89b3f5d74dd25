#include "collision/compound/overlapping_parts.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "collision/shapes/hull.hpp"
#include "tests/collision/moving_shapes.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

/// Parts in a common frame and their tree.
struct Compound {
  std::vector<std::vector<Vec3>> parts;
  BoxTree tree;

  Compound(std::vector<std::vector<Vec3>> all, std::uint32_t leafSize) : parts(std::move(all)) {
    std::vector<Aabb> boxes;
    for (const auto& part : parts)
      for (Aabb& box = boxes.emplace_back(); const Vec3& v : part) box.include(v);
    tree = buildBoxTree(boxes, leafSize);
  }
};

struct Placed {
  const Compound& compound;
  double margin;
  CompoundView view;
  std::vector<Aabb> boxes;

  Placed(const Compound& of, const Mat3& rotation, const Vec3& translation, double inflation)
      : compound(of), margin(inflation), view{&of.tree, rotation, translation, {}} {
    for (const auto& part : of.parts) {
      Aabb box;
      for (const Vec3& v : part) box.include(Vec3(rotation * v + translation));
      boxes.push_back(inflate(box, margin));
    }
  }
  PartBounds getBounds() const { return {view, boxes, margin}; }
};

std::vector<PartPair> findPairsByBruteForce(const Placed& a, const Placed& b) {
  std::vector<PartPair> pairs;
  for (std::uint32_t i = 0; i < a.boxes.size(); ++i)
    for (std::uint32_t j = 0; j < b.boxes.size(); ++j)
      if (overlaps(a.boxes[i], b.boxes[j])) pairs.push_back({i, j});
  return pairs;
}

std::vector<PartPair> findPairs(const Placed& a, const Placed& b, PartFront& front) {
  std::vector<PartPair> pairs{{7, 7}};  // replaced
  findOverlappingParts(a.getBounds(), b.getBounds(), front, pairs);
  return pairs;
}

/// A ring of small hulls around the y axis: concave, with a hole.
Compound makeRing(Random& random, int count, double radius, std::uint32_t leafSize = 1) {
  std::vector<std::vector<Vec3>> parts;
  for (int i = 0; i < count; ++i) {
    const double t = 4.0 * i / count;
    parts.push_back(makeRandomPoints(random, 8, 0.1));
    for (Vec3& p : parts.back()) p += Vec3(radius * computeWave(t), 0, radius * computeWave(t + 1));
  }
  return {parts, leafSize};
}

Compound makeCrumpledSheet(Random& random, int n, std::uint32_t leafSize = 1) {
  std::vector<std::vector<Vec3>> triangles;
  const double side = 2.0 / n;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const Vec3 at(side * i - 1, drawUniform(random, -0.05, 0.05), side * j - 1);
      triangles.push_back({at, at + Vec3(side, 0, 0), at + Vec3(0, 0, side)});
    }
  return {triangles, leafSize};
}

TEST(OverlappingParts, EqualThoseOfTheDoubleLoopAlongAMotion) {
  Random random(31);
  for (const std::uint32_t leafSize : {1u, 4u}) {
    const Compound ring = makeRing(random, 40, 1, leafSize),
                   sheet = makeCrumpledSheet(random, 16, leafSize);
    PartFront front;
    std::size_t pairs = 0, without = 0;
    for (int tick = 0; tick < 250; ++tick) {
      const double t = 0.02 * tick;
      const Placed a(ring, computeRotationAt(t, Vec3(1, 0.2, 0.4)), Vec3(0, 2 * computeWave(t), 0),
                     0.01);
      const Placed b(sheet, computeRotationAt(-0.3 * t, Vec3(0, 1, 1)), Vec3::Zero(), 0);
      const auto found = findPairs(a, b, front);
      ASSERT_EQ(found, findPairsByBruteForce(a, b)) << "tick " << tick;
      pairs += found.size();
      without += found.empty() ? 1 : 0;
    }
    EXPECT_GT(pairs, 1000u);
    EXPECT_GT(without, 20u);
    EXPECT_LT(front.aabbTests, 250u * 40 * 256 / 20);
  }
}

TEST(OverlappingParts, EqualThoseOfTheDoubleLoopWithJumpsAndChangingMargins) {
  Random random(32);
  const Compound ring = makeRing(random, 30, 1), other = makeRing(random, 24, 0.8, 3);
  PartFront front;
  Mat3 rotation = Mat3::Identity();
  Vec3 translation = Vec3::Zero();
  std::size_t pairs = 0;
  for (int tick = 0; tick < 2000; ++tick) {
    const double step = tick % 10 == 0 ? 3 : tick % 3 == 0 ? 0 : 0.02;  // jump, stand, move
    rotation =
        computeRotationAt(step * drawUniform(random, -1, 1), makeRandomPoint(random, 1)) * rotation;
    rotation = Quat(rotation).normalized().toRotationMatrix();
    translation = 0.9 * translation + makeRandomPoint(random, 0.4 * step);
    const Vec3 far = Vec3::Constant(tick < 1000 ? 0 : 1e6);  // where rounding is coarse
    const Placed a(ring, rotation, translation + far, drawUniform(random, 0, 0.05));
    const Placed b(other, computeRotationAt(tick / 400, Vec3(1, 1, 0)), far,
                   tick % 7 == 0 ? 0.3 : 0);
    const auto found = findPairs(a, b, front);
    ASSERT_EQ(found, findPairsByBruteForce(a, b)) << "tick " << tick;
    pairs += found.size();
  }
  EXPECT_GT(pairs, 10000u);
}

TEST(OverlappingParts, EqualThoseOfTheDoubleLoopInDeepTrees) {
  Random random(36);
  std::vector<std::vector<Vec3>> parts;  // each half as large as the last: the tree is a chain
  for (int i = 0; i < 60; ++i) {
    const double size = std::ldexp(1.0, -i);
    parts.push_back({Vec3(size, 0, 0), Vec3(1.5 * size, size, 0), Vec3(size, 0, size)});
  }
  const Compound spiral(parts, 1);
  PartFront front;
  std::size_t pairs = 0;
  for (int tick = 0; tick < 100; ++tick) {
    const Placed a(spiral, computeRotationAt(0.05 * tick, Vec3(1, 2, 3)),
                   makeRandomPoint(random, 0.01), 0);
    const Placed b(spiral, Mat3::Identity(), Vec3::Zero(), 1e-6);
    const auto found = findPairs(a, b, front);
    ASSERT_EQ(found, findPairsByBruteForce(a, b)) << "tick " << tick;
    pairs += found.size();
  }
  EXPECT_GT(pairs, 200u);
}

TEST(OverlappingParts, OfSinglePartsAndOfNone) {
  const Compound point({{Vec3(1, 0, 0)}}, 1), none({}, 1);
  PartFront front;
  std::size_t meetings = 0;
  for (int tick = 0; tick < 40; ++tick) {
    const Placed a(point, Mat3::Identity(), Vec3(computeWave(0.1 * tick), 0, 0), 0.25);
    const Placed b(point, Mat3::Identity(), Vec3::Zero(), 0.25);
    const auto found = findPairs(a, b, front);
    ASSERT_EQ(found, findPairsByBruteForce(a, b));
    meetings += found.size();
  }
  EXPECT_GT(meetings, 5u);
  EXPECT_LT(meetings, 35u);
  const Placed empty(none, Mat3::Identity(), Vec3::Zero(), 1);
  EXPECT_TRUE(findPairs(empty, empty, front).empty());
}

TEST(OverlappingParts, AFrontOfOtherTreesIsReset) {
  Random random(37);
  const Compound ring = makeRing(random, 20, 1), sheet = makeCrumpledSheet(random, 8);
  PartFront front;
  for (int tick = 0; tick < 20; ++tick) {
    const Compound& first = tick % 3 == 0 ? ring : sheet;
    const Placed a(first, computeRotationAt(tick, Vec3(1, 1, 0)),
                   Vec3(0, 0.1 * computeWave(tick), 0), 0.01);
    const Placed b(tick % 2 == 0 ? ring : sheet, Mat3::Identity(), Vec3::Zero(), 0);
    ASSERT_EQ(findPairs(a, b, front), findPairsByBruteForce(a, b)) << "tick " << tick;
  }
}

TEST(OverlappingParts, TheFrontRisesAgainWhenTheObjectsPart) {
  Random random(33);
  const Compound sheet = makeCrumpledSheet(random, 16), other = makeCrumpledSheet(random, 16);
  PartFront front;
  std::size_t deepest = 0;
  for (int tick = 0; tick <= 60; ++tick) {
    const Placed a(sheet, Mat3::Identity(), Vec3(0, 0.3 - 0.01 * tick, 0), 0);
    const Placed b(other, computeRotationAt(0.1, Vec3(0, 0, 1)), Vec3::Zero(), 0);
    ASSERT_EQ(findPairs(a, b, front), findPairsByBruteForce(a, b));
    deepest = std::max(deepest, front.entries.size());
  }
  EXPECT_GT(deepest, 500u);
  EXPECT_EQ(front.entries.size(), 1u);
}

TEST(OverlappingParts, ObjectsAtRestCostOnlyTheirOverlaps) {
  Random random(34);
  const Compound ring = makeRing(random, 40, 1), sheet = makeCrumpledSheet(random, 16);
  const Placed a(ring, computeRotationAt(1, Vec3(1, 0, 0)), Vec3::Zero(), 0.01);
  const Placed b(sheet, Mat3::Identity(), Vec3::Zero(), 0);
  PartFront front;
  const auto pairs = findPairs(a, b, front);
  const std::uint64_t fresh = front.aabbTests;
  ASSERT_EQ(findPairs(a, b, front), pairs);
  EXPECT_GT(pairs.size(), 5u);
  EXPECT_LE(front.aabbTests - fresh, 1 + 2 * pairs.size());  // the roots, then leaves and parts
}

TEST(OverlappingParts, TheFrontSavesMostOfADescentInSmallSteps) {
  Random random(35);
  const Compound ring = makeRing(random, 60, 1), sheet = makeCrumpledSheet(random, 16);
  PartFront front;
  std::uint64_t fresh = 0;
  for (int tick = 0; tick < 90; ++tick) {  // steps of 2 degrees
    const Placed a(ring, computeRotationAt(0.035 * tick, Vec3(0.3, 1, 0.2)), Vec3(0, 0.2, 0), 0.01);
    const Placed b(sheet, Mat3::Identity(), Vec3::Zero(), 0);
    PartFront cold;
    ASSERT_EQ(findPairs(a, b, front), findPairs(a, b, cold));
    fresh += cold.aabbTests;
  }
  EXPECT_LT(front.aabbTests, fresh / 2);
}

}  // namespace
}  // namespace enfilade::collision
