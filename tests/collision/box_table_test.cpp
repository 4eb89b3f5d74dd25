// Tests of the table of boxes that finds all overlapping pairs at once, against brute force.
#include "collision/broad_phase/box_table.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "tests/collision/checked_sweep.hpp"

namespace enfilade::collision {
namespace {

using Id = BoxTable::Id;
using IdPairs = std::vector<BoxTable::IdPair>;

IdPairs sortPairs(IdPairs pairs) {
  for (auto& [a, b] : pairs)
    if (a > b) std::swap(a, b);
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// With scalar comparisons, and in wide registers.
class BoxTables : public ::testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (GetParam() && !hasAvx())
      GTEST_SKIP() << "this processor has no AVX: only the scalar path is compared";
  }
  static std::size_t checkPairs(const std::vector<Aabb>& boxes, const Aabb& query);
};

INSTANTIATE_TEST_SUITE_P(By, BoxTables, ::testing::Bool(), [](const auto& useAvx) {
  return std::string(useAvx.param ? "Avx" : "Scalars");
});

/// Compares all pairs of the table, and those of one more box, with brute force. Returns the number
/// of pairs.
std::size_t BoxTables::checkPairs(const std::vector<Aabb>& boxes, const Aabb& query) {
  std::vector<SignedBounds> maxEndpoints;
  for (const Aabb& box : boxes) maxEndpoints.push_back(toMaxEndpoints(box));
  std::vector<Id> ids(boxes.size());
  std::iota(ids.begin(), ids.end(), Id{0});
  constexpr Id kQuery = 1u << 30;
  IdPairs expected, expectedByQuery;
  for (Id a = 0; a < boxes.size(); ++a) {
    for (Id b = a + 1; b < boxes.size(); ++b)
      if (overlaps(boxes[a], boxes[b])) expected.emplace_back(a, b);
    if (overlaps(boxes[a], query)) expectedByQuery.emplace_back(a, kQuery);
  }
  BoxTable table;
  table.useAvx = GetParam();
  table.build(maxEndpoints, ids);
  IdPairs found, foundByQuery;
  table.findPairs(found);
  table.findOverlaps(toMaxEndpoints(query), kQuery, foundByQuery);
  EXPECT_EQ(sortPairs(found), expected);
  EXPECT_EQ(sortPairs(foundByQuery), expectedByQuery);
  return expected.size();
}

TEST_P(BoxTables, FindsThePairsOfEqualBoxesInAnyDensity) {
  Random random(1);
  for (const double width : {0.5, 3.0, 10.0, 40.0, 4000.0}) {
    std::vector<Aabb> boxes;
    for (int k = 0; k < 300; ++k)
      boxes.push_back(
          makeBoxAt(drawVector(random, Vec3::Zero(), Vec3::Constant(width)), Vec3::Constant(1)));
    checkPairs(boxes, makeBoxAt(Vec3::Constant(width / 3), Vec3(1, 2, 3)));
  }
}

TEST_P(BoxTables, FindsThePairsOfBoxesOfAllSizesAndPlaces) {
  Random random(2);
  std::size_t pairs = 0;
  for (int round = 0; round < 40; ++round) {
    std::vector<Aabb> boxes;
    const auto randomBox = [&] {
      const double reach = std::exp2(drawInteger(random, -2, 8));
      const Vec3 size = std::exp2(drawInteger(random, -12, 8)) *
                        drawVector(random, Vec3::Zero(), Vec3::Constant(1));
      return makeBoxAt(drawVector(random, Vec3::Constant(-reach), Vec3::Constant(reach)), size);
    };
    for (int k = 0; k < 200; ++k) boxes.push_back(randomBox());
    pairs += checkPairs(boxes, randomBox());
  }
  EXPECT_GT(pairs, 10000u);
}

TEST_P(BoxTables, FindsThePairsOfFewLargeBoxesAmongManySmallOnes) {
  Random random(3);
  std::vector<Aabb> boxes;
  for (int k = 0; k < 600; ++k)
    boxes.push_back(
        makeBoxAt(drawVector(random, Vec3::Zero(), Vec3::Constant(60)), Vec3::Constant(0.3)));
  for (const double size : {20.0, 50.0, 1000.0})
    boxes.push_back(makeBoxAt(Vec3::Constant(-3), Vec3(size, 0.5 * size, size)));
  EXPECT_GT(checkPairs(boxes, makeBoxAt(Vec3::Constant(-1e9), Vec3::Constant(2e9))), 600u);
}

TEST_P(BoxTables, BoxesThatTouchOverlapAndThoseApartByOneRoundingDoNot) {
  Random random(4);
  for (const double centre : {0.0, 0.1, -7.3, 1e6 / 3, -1e12 / 7}) {
    std::vector<Aabb> boxes;
    for (int x = 0; x < 5; ++x)
      for (int y = 0; y < 5; ++y)
        for (int z = 0; z < 5; ++z) {
          const Vec3 corner = Vec3::Constant(centre) + Vec3(x, y, z) * 0.7;
          Aabb box{corner, corner + Vec3::Constant(0.7)};
          for (int axis = 0; axis < 3; ++axis) {  // touch the next one exactly, or almost
            const int chance = drawInteger(random, 0, 2);
            const double next = centre + (Vec3(x, y, z)[axis] + 1) * 0.7;
            box.max[axis] = chance == 0 ? next : std::nextafter(next, chance == 1 ? -1e300 : 1e300);
          }
          boxes.push_back(box);
        }
    EXPECT_GT(checkPairs(boxes, boxes[62]), 100u);
  }
}

TEST_P(BoxTables, RoundingNeverPutsBoxesThatTouchTwoCellsApart) {
  // Boxes as large as a cell, whose corners lie on both sides of the cells' borders. Without slack
  // in the cell size, the product with its inverse would be rounded down for one and up for the
  // other.
  Random random(6);
  for (int round = 0; round < 3000; ++round) {
    const double size = drawUniform(random, 0.01, 3);
    const double far = round % 2 == 0 ? 0 : 0x1p38;  // cells away: corners are rounded, too
    const double border = size * (far + drawInteger(random, -40, 40));
    std::vector<Aabb> boxes;
    for (const double below : {border, std::nextafter(border, -1e300)}) {
      for (const double above : {below + size, std::nextafter(below + size, 1e300)}) {
        boxes.push_back({Vec3(below, 0, 0), Vec3(above, size, size)});
        boxes.push_back({Vec3(above, 0, 0), Vec3(above + size, size, size)});
      }
    }
    ASSERT_GT(checkPairs(boxes, boxes[0]), 4u);
    if (HasFailure()) return;
  }
}

TEST_P(BoxTables, AcceptsPointsHugeCoordinatesAndDistantClusters) {
  Random random(5);
  std::vector<Aabb> boxes;
  for (const double centre : {-1e300, -1e15, 0.0, 5e-324, 1e9, 1.7e308})
    for (int k = 0; k < 20; ++k) {
      const Vec3 corner =
          Vec3::Constant(centre) + drawVector(random, Vec3::Zero(), Vec3::Constant(2));
      boxes.push_back(makeBoxAt(corner, Vec3::Constant(k % 3 == 0 ? 0.0 : 1.0)));
    }
  boxes.push_back({Vec3::Constant(-1.7e308), Vec3::Constant(1.7e308)});
  boxes.push_back({Vec3::Zero(), Vec3(5e-324, 0, 0)});
  EXPECT_GT(checkPairs(boxes, makeBoxAt(Vec3::Constant(1e9), Vec3::Zero())), 100u);
}

TEST_P(BoxTables, FindsThePairsOfBoxesOfHundredsOfSizes) {
  std::vector<Aabb> boxes;  // no two have sizes of one level
  for (int k = -150; k < 150; ++k)
    boxes.push_back(makeBoxAt(Vec3::Zero(), Vec3::Constant(std::ldexp(1.0, 2 * k))));
  const double size = std::ldexp(1.0, 299);  // many of the largest level, which all overlap
  Random random(7);
  for (int k = 0; k < 20; ++k)
    boxes.push_back(
        makeBoxAt(drawVector(random, Vec3::Constant(-0.5 * size), Vec3::Constant(0.5 * size)),
                  Vec3::Constant(size)));
  EXPECT_GT(checkPairs(boxes, boxes[299]), 40000u);
}

TEST_P(BoxTables, FindsNothingInAnEmptyTable) {
  EXPECT_EQ(checkPairs({}, makeBoxAt(Vec3::Zero(), Vec3::Ones())), 0u);
  EXPECT_EQ(
      checkPairs({makeBoxAt(Vec3::Zero(), Vec3::Ones())}, makeBoxAt(Vec3::Ones(), Vec3::Ones())),
      0u);
}

}  // namespace
}  // namespace enfilade::collision
