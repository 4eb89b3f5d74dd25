// Nearest parts of two compound objects: those by brute force, whether or not the parts have boxes.
// With boxes, parts out of reach are not placed.
#include "collision/compound/nearest_parts.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "collision/motion/moving_pose.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision {
namespace {

using namespace testing;

constexpr double kAnyDistance = std::numeric_limits<double>::infinity();

/// Random small hulls in a cloud at a pose.
struct Cloud {
  std::vector<Hull> parts;
  BoxTree tree;
  Mat3 rotation;
  Vec3 translation;

  Cloud(Random& random, const Vec3& at, std::uint32_t leafSize)
      : rotation(integrateRotation(Mat3::Identity(), makeRandomPoint(random, 2), 1)),
        translation(at) {
    std::vector<Aabb> boxes;
    for (int i = 0; i < 40; ++i) {
      const Vec3 middle = makeRandomPoint(random, 1);
      std::vector<Vec3> points = makeRandomPoints(random, 9, 0.1);
      for (Vec3& point : points) point += middle;
      parts.push_back(buildHull(points));
      for (Aabb& box = boxes.emplace_back(); const Vec3& v : parts.back().vertices) box.include(v);
    }
    tree = buildBoxTree(boxes, leafSize);
  }

  PlacedConvex place(std::uint32_t part) const {
    return {parts[part].vertices, translation, &rotation, &parts[part]};
  }
  Aabb computeBox(std::uint32_t part) const {
    Aabb box;
    for (const Vec3& v : parts[part].vertices) box.include(rotation * v + translation);
    return box;
  }
  CompoundView makeView(std::size_t& placed) const {
    return {&tree, rotation, translation, [this, &placed](std::uint32_t item) {
              ++placed;
              return place(tree.order[item]);
            }};
  }
  CompoundView makeViewWithBoxes(std::size_t& placed) const {
    CompoundView with = makeView(placed);
    with.box = [this](std::uint32_t item) { return computeBox(tree.order[item]); };
    return with;
  }
};

double findDistanceByBruteForce(const Cloud& a, const Cloud& b) {
  double distance = kAnyDistance;
  for (std::uint32_t i = 0; i < a.parts.size(); ++i)
    for (std::uint32_t k = 0; k < b.parts.size(); ++k) {
      FeatureCache cache;
      distance = std::min(distance, computeSeparation(a.place(i), b.place(k), cache).distance);
    }
  return distance;
}

NearestParts findNearest(const CompoundView& a, const CompoundView& b) {
  std::size_t budget = std::numeric_limits<std::size_t>::max();
  return findNearestParts({&a, 1}, {&b, 1}, kAnyDistance, budget);
}

TEST(NearestParts, AreThoseByBruteForceAndWithBoxesOfPartsFewerArePlaced) {
  Random random(27);
  std::size_t placed = 0, placedWithBoxes = 0;
  for (const std::uint32_t leafSize : {1u, 4u}) {
    for (int i = 0; i < 50; ++i) {
      const Cloud a(random, makeRandomPoint(random, 1), leafSize),
          b(random, Vec3(2.8, 0, 0) + makeRandomPoint(random, 1), leafSize);
      const double distance = findDistanceByBruteForce(a, b);
      const NearestParts nearest = findNearest(a.makeView(placed), b.makeView(placed));
      EXPECT_EQ(nearest.separation.distance, distance) << "pair " << i;
      const NearestParts withBoxes =
          findNearest(a.makeViewWithBoxes(placedWithBoxes), b.makeViewWithBoxes(placedWithBoxes));
      EXPECT_EQ(withBoxes.separation.distance, distance) << "pair " << i;
      EXPECT_EQ(withBoxes.a.hull, nearest.a.hull);
      EXPECT_EQ(withBoxes.b.hull, nearest.b.hull);
    }
  }
  EXPECT_LT(2 * placedWithBoxes, placed);
}

}  // namespace
}  // namespace enfilade::collision
