#include "collision/shapes/triangle_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

TEST(TriangleTree, EqualsBruteForce) {
  Random random(11);
  for (const std::size_t size : {0u, 1u, 4u, 5u, 300u, 3000u}) {
    std::vector<Triangle> triangles;
    for (std::size_t i = 0; i < size; ++i) {
      const Vec3 at = makeRandomPoint(random, 10);
      triangles.push_back({at, at + makeRandomPoint(random, 1), at + makeRandomPoint(random, 1)});
    }
    const TriangleTree tree(triangles);
    ASSERT_EQ(tree.triangles().size(), size);
    std::size_t hits = 0;
    for (int q = 0; q < 50; ++q) {
      const Aabb box = inflate(Aabb{Vec3::Zero(), Vec3::Zero()}, drawUniform(random, 0, 4));
      const Vec3 at = makeRandomPoint(random, 8);
      const Aabb query{box.min + at, box.max + at};
      std::vector<std::uint32_t> found, expected;
      tree.query(query, found);
      for (std::uint32_t i = 0; i < size; ++i) {
        Aabb b;
        for (const Vec3& p : tree.triangles()[i]) b.include(p);
        if (overlaps(b, query)) expected.push_back(i);
      }
      EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
      EXPECT_EQ(found, expected);
      hits += found.size();
    }
    if (size >= 300) {
      EXPECT_GT(hits, 50u);
    }
  }
}

}  // namespace
}  // namespace enfilade::collision
