#include "collision/broad_phase/sort_and_sweep.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <stdexcept>

#include "tests/collision/checked_sweep.hpp"

namespace enfilade::collision {
namespace {

TEST(SortAndSweep, EqualsBruteForceForWalkersAmongFurniture) {
  Random random(1);
  const Vec3 extent(30, 6, 30);
  CheckedSweep scene(makeFurnishedHall(random, 900, extent));
  std::vector<Vec3> velocity;
  for (int k = 0; k < 100; ++k) {
    scene.insert(makeBoxAt(drawVector(random, Vec3::Zero(), extent), Vec3(0.6, 1.75, 0.6)));
    velocity.push_back(drawVector(random, Vec3(-0.1, -0.02, -0.1), Vec3(0.1, 0.02, 0.1)));
  }
  for (int tick = 0; tick < 300; ++tick) {
    for (const auto& [id, box] : std::map(scene.getDynamicBoxes())) {
      Vec3& v = velocity[id];
      for (int axis = 0; axis < 3; ++axis) {
        if (box.min[axis] < -3 || box.min[axis] > extent[axis] + 3) {
          v[axis] = std::copysign(v[axis], box.min[axis] < 0 ? 1.0 : -1.0);
        }
      }
      if (drawInteger(random, 0, 9) > 0) scene.move(id, {box.min + v, box.max + v});
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.pairsAdded, 1000u);
  EXPECT_GT(scene.pairsRemoved, 1000u);
  EXPECT_GT(scene.dynamicPairsAdded, 20u);
}

TEST(SortAndSweep, FindsTheStaticBoxesAroundAnUnregisteredBox) {
  Random random(8);
  const Vec3 extent(30, 6, 30);
  const std::vector<Aabb> staticBoxes = makeFurnishedHall(random, 900, extent);
  const SortAndSweep sweep(staticBoxes);
  std::size_t found = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3 size = Vec3::Constant(k % 3 == 0 ? 0 : k % 3 == 1 ? 1 : 40);
    const Aabb box = makeBoxAt(drawVector(random, Vec3::Constant(-2), extent), size);
    std::vector<StaticId> expected;
    for (const ProxyPair& pair :
         findPairsBruteForce(staticBoxes, std::vector{std::pair{ProxyId{0}, box}})) {
      expected.push_back(pair.other);
    }
    EXPECT_EQ(sweep.overlapStatic(box), expected) << "box " << k;
    found += expected.size();
  }
  EXPECT_GT(found, 3000u);
  EXPECT_TRUE(SortAndSweep({}).overlapStatic(makeBoxAt(Vec3::Zero(), Vec3::Ones())).empty());
}

TEST(SortAndSweep, EqualsBruteForceForBodiesThatGrowAndShrink) {
  Random random(2);
  CheckedSweep scene(makeFurnishedHall(random, 500, Vec3(12, 6, 12)));
  struct Body {
    Vec3 centre, phase;
  };
  std::vector<Body> bodies;
  for (int k = 0; k < 40; ++k) {
    bodies.push_back({drawVector(random, Vec3::Zero(), Vec3(12, 6, 12)),
                      drawVector(random, Vec3::Zero(), Vec3::Constant(6))});
    scene.insert(makeBoxAt(bodies.back().centre, Vec3::Zero()));
  }
  for (int tick = 0; tick < 300; ++tick) {
    for (ProxyId id = 0; id < bodies.size(); ++id) {
      Body& body = bodies[id];
      body.phase += Vec3(0.11, 0.07, 0.13);
      body.centre += drawVector(random, Vec3::Constant(-0.05), Vec3::Constant(0.05));
      const Vec3 half = (body.phase.array().sin().abs() * 0.9).matrix();
      scene.move(id, {body.centre - half, body.centre + half});
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.pairsAdded, 2500u);
  EXPECT_GT(scene.dynamicPairsAdded, 200u);
}

TEST(SortAndSweep, AProxyThatCirclesAnotherOverlapsOnEachSideAndIsTestedOnlyAtCorners) {
  // Unit boxes; one circles the other on squares that miss it by a step, touch it, and cut it.
  constexpr double kStep = 1.0 / 16;  // exact in doubles, so contacts are exact
  const Vec3 middle(3, 7, -5);
  CheckedSweep scene({});
  std::array<ProxyId, 2> ids;
  for (ProxyId& id : ids) id = scene.insert(makeBoxAt(middle, Vec3::Ones()));
  std::size_t quiet = 0, tested = 0;
  for (const ProxyId goes : ids) {
    for (int around = 0; around < 3; ++around) {
      for (const int radius : {17, 16, 17, 15, 17}) {
        for (int k = 0; k < 8 * radius; ++k) {
          const int side = k / (2 * radius), along = k % (2 * radius) - radius;
          const double u = kStep * (side % 2 == 0 ? along : radius) * (side < 2 ? 1 : -1);
          const double v = kStep * (side % 2 == 0 ? -radius : along) * (side < 2 ? 1 : -1);
          Vec3 corner = middle;
          corner[around] += u;
          corner[(around + 1) % 3] += v;
          scene.move(goes, makeBoxAt(corner, Vec3::Ones()));
          ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "radius " << radius << ", step " << k;
          if (radius < 17 || scene.getSweep().counters().windowsBuilt > 0) continue;
          (scene.getSweep().counters().aabbTests == 0 ? quiet : tested) += 1;
        }
      }
      scene.move(goes, makeBoxAt(middle, Vec3::Ones()));
    }
  }
  EXPECT_EQ(scene.dynamicPairsAdded, 12u);
  EXPECT_GT(quiet, 20 * tested);
  EXPECT_GT(tested, 12u);
}

TEST(SortAndSweep, EqualsBruteForceWhenProxiesAppearVanishAndJump) {
  Random random(3);
  const Vec3 extent(12, 6, 12);
  CheckedSweep scene(makeFurnishedHall(random, 700, extent));
  const auto anyBox = [&] {
    const Vec3 corner = drawVector(random, Vec3(-4, -3, -4), extent + Vec3(4, 3, 4));
    return makeBoxAt(corner, drawVector(random, Vec3::Zero(), Vec3::Constant(3)));
  };
  std::size_t removed = 0;
  for (int tick = 0; tick < 300; ++tick) {
    while (scene.getDynamicBoxes().size() < 25 || drawInteger(random, 0, 2) == 0)
      scene.insert(anyBox());
    for (const auto& [id, box] : std::map(scene.getDynamicBoxes())) {
      const int what = drawInteger(random, 0, 11);
      if (what == 0) {
        scene.move(id, anyBox());
      } else if (what == 1) {
        if (drawInteger(random, 0, 1) == 0) scene.move(id, anyBox());
        scene.remove(id);
        ++removed;
        if (drawInteger(random, 0, 1) == 0) scene.insert(box);
      } else if (what < 8) {
        const Vec3 step = drawVector(random, Vec3::Constant(-0.1), Vec3::Constant(0.1));
        scene.move(id, {box.min + step, box.max + step});
        scene.move(id, {box.min - step, box.max - step});
      }
    }
    const ProxyId passing = scene.insert(anyBox());
    if (drawInteger(random, 0, 1) == 0) scene.remove(passing);
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(removed, 300u);
  EXPECT_GT(scene.pairsAdded, 3000u);
  EXPECT_GT(scene.dynamicPairsAdded, 100u);
}

TEST(SortAndSweep, EqualsBruteForceWhenEndPointsAreTied) {
  for (const double unit : {1.0, 0.1, 1e-200, 1e200}) {
    Random random(4);
    const auto lattice = [&](int low, int high) {
      const int x = drawInteger(random, low, high), y = drawInteger(random, low, high),
                z = drawInteger(random, low, high);
      return Vec3(x * unit, y * unit, z * unit);
    };
    std::vector<Aabb> staticBoxes;
    for (int k = 0; k < 300; ++k) staticBoxes.push_back(makeBoxAt(lattice(0, 12), lattice(0, 2)));
    CheckedSweep scene(staticBoxes);
    for (int k = 0; k < 30; ++k) scene.insert(makeBoxAt(lattice(0, 12), lattice(0, 2)));
    for (int tick = 0; tick < 200; ++tick) {
      for (const auto& [id, box] : std::map(scene.getDynamicBoxes())) {
        const Vec3 step = lattice(-1, 1);
        const Vec3 low = (box.min + step).cwiseMax(-2 * unit).cwiseMin(14 * unit);
        if (drawInteger(random, 0, 3) > 0) scene.move(id, makeBoxAt(low, lattice(0, 2)));
      }
      ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick << " unit " << unit;
    }
    EXPECT_GT(scene.pairsAdded, 3000u);
    EXPECT_GT(scene.dynamicPairsAdded, 150u);
  }
}

TEST(SortAndSweep, EqualsBruteForceInAStackOfEqualBoxesWithADistantOne) {
  Random random(5);
  std::vector<Aabb> staticBoxes(200, makeBoxAt(Vec3(1, 1, 1), Vec3(1, 1, 1)));
  for (int k = 0; k < 100; ++k)
    staticBoxes.push_back(makeBoxAt(Vec3(2, 0.01 * k, 1), Vec3(0, 0, 0)));
  staticBoxes.push_back(makeBoxAt(Vec3(1e12, -1e12, 5), Vec3(1, 1, 1)));
  staticBoxes.push_back(makeBoxAt(Vec3(-1e3, 0, -1e3), Vec3(2e3, 0.1, 2e3)));
  CheckedSweep scene(staticBoxes);
  for (int k = 0; k < 10; ++k) {
    scene.insert(
        makeBoxAt(drawVector(random, Vec3::Zero(), Vec3::Constant(3)), Vec3(0.5, 0.5, 0.5)));
  }
  for (int tick = 0; tick < 200; ++tick) {
    for (const auto& [id, box] : std::map(scene.getDynamicBoxes())) {
      const Vec3 step = drawVector(random, Vec3::Constant(-0.2), Vec3::Constant(0.2));
      scene.move(id, {box.min + step, box.max + step});
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.pairsAdded, 3000u);
}

TEST(SortAndSweep, EqualsBruteForceOverAHugeRangeOfCoordinatesAndSizes) {
  Random random(6);
  const auto wild = [&] {
    const auto magnitude = [&] {
      const double value = std::pow(10.0, drawUniform(random, -6, 300));
      return drawInteger(random, 0, 1) == 0 ? value : -value;
    };
    const double a = magnitude(), b = magnitude(), c = magnitude();
    const double d = magnitude(), e = magnitude(), f = magnitude();
    Aabb box;
    box.include(Vec3(a, b, c));
    box.include(Vec3(d, e, f));
    return box;
  };
  std::vector<Aabb> staticBoxes;
  for (int k = 0; k < 150; ++k) staticBoxes.push_back(wild());
  staticBoxes.push_back(makeBoxAt(Vec3::Constant(-1.7e308), Vec3::Zero()));
  staticBoxes.push_back(makeBoxAt(Vec3::Constant(1.7e308), Vec3::Zero()));
  CheckedSweep scene(staticBoxes);
  for (int k = 0; k < 20; ++k) scene.insert(wild());
  for (int tick = 0; tick < 200; ++tick) {
    for (const auto& [id, box] : std::map(scene.getDynamicBoxes())) {
      if (drawInteger(random, 0, 2) == 0) scene.move(id, wild());
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.pairsAdded, 2000u);
}

TEST(SortAndSweep, AcceptsProxiesMuchLargerThanTheCellsOrTheScene) {
  Random random(7);
  const Vec3 extent(60, 9, 60);
  CheckedSweep scene(makeFurnishedHall(random, 3000, extent));
  for (int k = 0; k < 4; ++k) {
    scene.insert(makeBoxAt(drawVector(random, Vec3::Zero(), extent), Vec3(30, 5, 20)));
  }
  scene.insert(makeBoxAt(Vec3::Constant(-1e9), Vec3::Constant(2e9)));
  for (int tick = 0; tick < 200; ++tick) {
    for (const auto& [id, box] : std::map(scene.getDynamicBoxes())) {
      const Vec3 step = drawVector(random, Vec3::Constant(-1), Vec3::Constant(1));
      scene.move(id, {box.min + step, box.max + step});
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.pairsAdded, 3000u);
}

TEST(SortAndSweep, WorksWithoutStaticBoxes) {
  Random random(8);
  CheckedSweep scene({});
  for (int k = 0; k < 60; ++k) {
    scene.insert(makeBoxAt(drawVector(random, Vec3::Zero(), Vec3::Constant(5)), Vec3::Ones()));
  }
  for (int tick = 0; tick < 200; ++tick) {
    for (const auto& [id, box] : std::map(scene.getDynamicBoxes())) {
      const Vec3 step = drawVector(random, Vec3::Constant(-0.1), Vec3::Constant(0.1));
      scene.move(id, {box.min + step, box.max + step});
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.dynamicPairsAdded, 300u);
}

TEST(SortAndSweep, BoxesThatShareOnlyABoundaryPointOverlap) {
  CheckedSweep scene({makeBoxAt(Vec3::Zero(), Vec3::Ones())});
  const ProxyId id = scene.insert(makeBoxAt(Vec3::Ones(), Vec3::Ones()));
  scene.updateAndCheck();
  EXPECT_EQ(scene.getSweep().pairCount(), 1u);
  const double apart = std::nextafter(1.0, 2.0);
  scene.move(id, makeBoxAt(Vec3(1, apart, 1), Vec3::Ones()));
  scene.updateAndCheck();
  EXPECT_EQ(scene.getSweep().removedPairs().size(), 1u);
  scene.move(id, makeBoxAt(Vec3(1, 1, 1), Vec3::Ones()));
  scene.updateAndCheck();
  EXPECT_EQ(scene.getSweep().addedPairs().size(), 1u);
}

TEST(SortAndSweep, ReportsThePairsOfARemovedProxyAsRemoved) {
  CheckedSweep scene({makeBoxAt(Vec3::Zero(), Vec3::Ones())});
  const ProxyId a = scene.insert(makeBoxAt(Vec3::Zero(), Vec3::Ones()));
  const ProxyId b = scene.insert(makeBoxAt(Vec3::Zero(), Vec3::Ones()));
  scene.updateAndCheck();
  scene.remove(a);
  const ProxyId c = scene.insert(makeBoxAt(Vec3::Zero(), Vec3::Ones()));
  EXPECT_NE(c, a) << "the id is free only after the update that reports its removal";
  scene.updateAndCheck();
  const Pairs ended(scene.getSweep().removedPairs().begin(), scene.getSweep().removedPairs().end());
  EXPECT_EQ(ended, (Pairs{{a, 0, false}, {a, b, true}}));
  EXPECT_TRUE(scene.getSweep().getOverlaps(a).empty());
  EXPECT_EQ(scene.insert(makeBoxAt(Vec3::Zero(), Vec3::Ones())), a);
}

TEST(SortAndSweep, OmitsAPairThatBeginsAndEndsWithinAnUpdate) {
  CheckedSweep scene({makeBoxAt(Vec3::Zero(), Vec3::Ones())});
  const ProxyId id = scene.insert(makeBoxAt(Vec3::Constant(5), Vec3::Ones()));
  scene.updateAndCheck();
  scene.move(id, makeBoxAt(Vec3::Zero(), Vec3::Ones()));
  scene.move(id, makeBoxAt(Vec3::Constant(5), Vec3::Ones()));
  scene.updateAndCheck();
  EXPECT_TRUE(scene.getSweep().addedPairs().empty());
  EXPECT_TRUE(scene.getSweep().removedPairs().empty());
}

TEST(SortAndSweep, RefusesBoxesThatAreEmptyOrNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const Aabb good = makeBoxAt(Vec3::Zero(), Vec3::Ones());
  const std::vector<Aabb> bad{Aabb{},
                              makeBoxAt(Vec3(0, nan, 0), Vec3::Ones()),
                              {Vec3(0, 0, -infinity), Vec3::Ones()},
                              {Vec3(0, 2, 0), Vec3::Ones()}};
  SortAndSweep sweep(std::vector<Aabb>{good});
  const ProxyId id = sweep.insert(good);
  sweep.update();
  for (const Aabb& box : bad) {
    EXPECT_THROW(SortAndSweep(std::vector<Aabb>{good, box}), std::invalid_argument);
    EXPECT_THROW(sweep.insert(box), std::invalid_argument);
    EXPECT_THROW(sweep.move(id, box), std::invalid_argument);
  }
  EXPECT_THROW(sweep.move(id + 1, good), std::invalid_argument);
  EXPECT_THROW(sweep.remove(id + 1), std::invalid_argument);
  sweep.update();
  EXPECT_EQ(sweep.pairCount(), 1u);
}

TEST(SortAndSweep, CountsNothingWhileNothingMoves) {
  Random random(9);
  CheckedSweep scene(makeFurnishedHall(random, 500, Vec3(10, 3, 10)));
  for (int k = 0; k < 20; ++k) {
    scene.insert(makeBoxAt(drawVector(random, Vec3::Zero(), Vec3(10, 3, 10)), Vec3::Ones()));
  }
  scene.updateAndCheck();
  EXPECT_GT(scene.getSweep().counters().windowsBuilt, 0u);
  EXPECT_GT(scene.getSweep().pairCount(), 50u);
  for (const auto& [id, box] : scene.getDynamicBoxes()) scene.getSweep().move(id, box);
  scene.updateAndCheck();
  EXPECT_EQ(scene.getSweep().counters().swaps, 0u);
  EXPECT_EQ(scene.getSweep().counters().windowsBuilt, 0u);
  EXPECT_EQ(scene.getSweep().counters().aabbTests, 0u);
}

TEST(SortAndSweep, BuildsNoWindowsForStationaryProxies) {
  const Aabb staticBoxes = makeBoxAt({0, 0, 0}, {1, 1, 1});
  for (const Vec3& size : {Vec3(1, 0, 1), Vec3(0, 0, 0), Vec3(1, 1, 1)}) {
    for (const double far : {0.0, 1e17}) {
      SortAndSweep sweep(std::span(&staticBoxes, 1));
      const Aabb box = makeBoxAt({far, 0, 0}, size);
      const ProxyId id = sweep.insert(box);
      sweep.update();
      for (int tick = 0; tick < 100; ++tick) {
        sweep.move(id, box);
        sweep.update();
        EXPECT_EQ(sweep.counters().windowsBuilt, 0U) << "tick " << tick;
      }
    }
  }
}

TEST(SortAndSweep, RemovesAllPairsWhenAllProxiesJump) {
  const Aabb slab = makeBoxAt({-5000, -1, -5000}, {10000, 1, 10000});
  SortAndSweep sweep(std::span(&slab, 1));
  constexpr int kDynamicBoxes = 100;
  const auto makeBox = [](int k, double x) { return makeBoxAt({x + 3 * k, 0.5, 0}, {1, 1, 1}); };
  for (int k = 0; k < kDynamicBoxes; ++k) sweep.insert(makeBox(k, 0));
  sweep.update();
  for (int tick = 1; tick < 5; ++tick) {
    for (ProxyId k = 0; k < kDynamicBoxes; ++k)
      sweep.move(k, makeBox(static_cast<int>(k), 100 + 0.001 * tick));
    sweep.update();
  }
  EXPECT_LE(sweep.counters().aabbTests,
            4U * kDynamicBoxes);  // those of neighbours, not all of them
}

TEST(SortAndSweep, ARemovedProxyCannotBeMovedEvenToItsPosition) {
  const Aabb box = makeBoxAt({0.5, 0.5, 0.5}, {1, 1, 1});
  SortAndSweep sweep(std::span(&box, 1));
  const ProxyId id = sweep.insert(box);
  sweep.update();
  sweep.remove(id);
  EXPECT_THROW(sweep.move(id, box), std::invalid_argument);
  EXPECT_THROW(sweep.remove(id), std::invalid_argument);
}

TEST(SortAndSweep, CountsTheEndpointsThatAProxyPasses) {
  // Ten posts in a row; a walker passes both ends of the first five on x.
  std::vector<Aabb> posts;
  for (int k = 0; k < 10; ++k) posts.push_back(makeBoxAt(Vec3(k, 0, 0), Vec3(0.1, 2, 0.1)));
  SortAndSweep sweep(posts);
  const ProxyId id = sweep.insert(makeBoxAt(Vec3(-1, 0.5, 0), Vec3(0.05, 1, 0.05)));
  sweep.update();
  std::uint64_t swaps = 0, begins = 0, ends = 0;
  for (int tick = 1; tick <= 55; ++tick) {
    sweep.move(id, makeBoxAt(Vec3(-1 + 0.1 * tick, 0.5, 0), Vec3(0.05, 1, 0.05)));
    sweep.update();
    swaps += sweep.counters().swaps;
    begins += sweep.addedPairs().size();
    ends += sweep.removedPairs().size();
  }
  EXPECT_EQ(begins, 5u);
  EXPECT_EQ(ends, 5u);
  EXPECT_LE(swaps, 10u);  // entering a window does not swap past its endpoints
  EXPECT_GE(swaps, 8u);
}

/// Swaps and AABB tests per proxy and tick, among `count` boxes of one density.
double measureWorkPerProxy(std::size_t count) {
  Random random(10);
  const double side = std::sqrt(static_cast<double>(count) / 2.0);
  SortAndSweep sweep(makeFurnishedHall(random, count, Vec3(side, 3, side)));
  std::vector<Aabb> boxes;
  std::vector<ProxyId> ids;
  for (int k = 0; k < 20; ++k) {
    boxes.push_back(
        makeBoxAt(drawVector(random, Vec3::Zero(), Vec3(side, 1, side)), Vec3(0.6, 1.75, 0.6)));
    ids.push_back(sweep.insert(boxes.back()));
  }
  sweep.update();
  std::uint64_t work = 0;
  for (int tick = 0; tick < 200; ++tick) {
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const Vec3 step(k % 2 == 0 ? 0.025 : -0.025, 0, k % 3 == 0 ? 0.01 : -0.01);
      boxes[k] = {boxes[k].min + step, boxes[k].max + step};
      sweep.move(ids[k], boxes[k]);
    }
    sweep.update();
    work += sweep.counters().swaps + sweep.counters().aabbTests;
  }
  return static_cast<double>(work) / 200 / 20;
}

TEST(SortAndSweep, WorkPerProxyDoesNotGrowWithTheScene) {
  const double small = measureWorkPerProxy(1000);
  const double large = measureWorkPerProxy(100000);
  EXPECT_GT(small, 0.1);
  EXPECT_LT(large, 1.5 * small);
  EXPECT_LT(large, 20);
}

TEST(SortAndSweep, AStraightWalkRarelyRebuildsTheWindow) {
  Random random(12);
  SortAndSweep sweep(makeFurnishedHall(random, 20000, Vec3(100, 3, 100)));
  std::vector<Aabb> boxes;
  for (int k = 0; k < 50; ++k) {
    boxes.push_back(
        makeBoxAt(drawVector(random, Vec3(5, 0, 5), Vec3(80, 1, 80)), Vec3(0.6, 1.75, 0.6)));
    sweep.insert(boxes.back());
  }
  sweep.update();
  std::uint64_t laid = 0, maxWindows = 0, swaps = 0;
  for (int tick = 0; tick < 300; ++tick) {
    for (ProxyId id = 0; id < boxes.size(); ++id) {
      const Vec3 step(0.02, 0, 0.015);
      boxes[id] = {boxes[id].min + step, boxes[id].max + step};
      sweep.move(id, boxes[id]);
    }
    sweep.update();
    laid += sweep.counters().windowsBuilt;
    maxWindows = std::max(maxWindows, sweep.counters().windowsBuilt);
    swaps += sweep.counters().swaps;
  }
  EXPECT_GT(swaps, 1000u);
  EXPECT_GT(laid, 50u);
  EXPECT_LT(laid, 300u * 50 / 20) << "a cell lasts for more than 20 ticks";
  EXPECT_LT(maxWindows, 10u) << "few windows are built in one tick";
}

TEST(SortAndSweep, UsesFewBytesInAdditionToTheBoxes) {
  Random random(13);
  const SortAndSweep sweep(makeFurnishedHall(random, 50000, Vec3(150, 3, 150)));
  EXPECT_GT(sweep.staticOverheadBytes(), 50000u * 16) << "at least one cell entry per box";
  EXPECT_LT(sweep.staticOverheadBytes(), 50000u * 40);
}

TEST(SortAndSweep, ResultsDoNotDependOnTheOrderOfTheStaticBoxes) {
  Random random(11);
  std::vector<Aabb> staticBoxes = makeFurnishedHall(random, 400, Vec3(10, 3, 10));
  SortAndSweep sweep(staticBoxes);
  const Aabb box = makeBoxAt(Vec3(3, 0, 3), Vec3(2, 2, 2));
  const ProxyId id = sweep.insert(box);
  sweep.update();
  const auto last = static_cast<std::uint32_t>(staticBoxes.size() - 1);
  std::reverse(staticBoxes.begin(), staticBoxes.end());
  SortAndSweep reversed(staticBoxes);
  reversed.insert(box);
  reversed.update();
  ASSERT_EQ(sweep.pairCount(), reversed.pairCount());
  ASSERT_GT(sweep.pairCount(), 5u);
  const auto a = sweep.getOverlaps(id), b = reversed.getOverlaps(id);
  for (std::size_t k = 0; k < a.size(); ++k) EXPECT_EQ(a[k].id, last - b[a.size() - 1 - k].id);
}

}  // namespace
}  // namespace enfilade::collision
