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
  Watched scene(furnishedHall(random, 900, extent));
  std::vector<Vec3> velocity;
  for (int k = 0; k < 100; ++k) {
    scene.insert(boxAt(uniform3(random, Vec3::Zero(), extent), Vec3(0.6, 1.75, 0.6)));
    velocity.push_back(uniform3(random, Vec3(-0.1, -0.02, -0.1), Vec3(0.1, 0.02, 0.1)));
  }
  for (int tick = 0; tick < 300; ++tick) {
    for (const auto& [id, box] : std::map(scene.movers())) {
      Vec3& v = velocity[id];
      for (int axis = 0; axis < 3; ++axis) {
        if (box.min[axis] < -3 || box.min[axis] > extent[axis] + 3) {
          v[axis] = std::copysign(v[axis], box.min[axis] < 0 ? 1.0 : -1.0);
        }
      }
      if (dice(random, 0, 9) > 0) scene.move(id, {box.min + v, box.max + v});
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.begins, 1000u);
  EXPECT_GT(scene.ends, 1000u);
  EXPECT_GT(scene.movingBegins, 20u);
}

TEST(SortAndSweep, FindsTheStillBoxesAboutABoxThatIsNoMover) {
  Random random(8);
  const Vec3 extent(30, 6, 30);
  const std::vector<Box> still = furnishedHall(random, 900, extent);
  const SortAndSweep sweep(still);
  std::size_t found = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3 size = Vec3::Constant(k % 3 == 0 ? 0 : k % 3 == 1 ? 1 : 40);
    const Box box = boxAt(uniform3(random, Vec3::Constant(-2), extent), size);
    std::vector<StillId> expected;
    for (const BoxPair& pair : bruteForcePairs(still, std::vector{std::pair{MoverId{0}, box}})) {
      expected.push_back(pair.other);
    }
    EXPECT_EQ(sweep.stillOverlapping(box), expected) << "box " << k;
    found += expected.size();
  }
  EXPECT_GT(found, 3000u);
  EXPECT_TRUE(SortAndSweep({}).stillOverlapping(boxAt(Vec3::Zero(), Vec3::Ones())).empty());
}

TEST(SortAndSweep, EqualsBruteForceForBodiesThatGrowAndShrink) {
  Random random(2);
  Watched scene(furnishedHall(random, 500, Vec3(12, 6, 12)));
  struct Body {
    Vec3 centre, phase;
  };
  std::vector<Body> bodies;
  for (int k = 0; k < 40; ++k) {
    bodies.push_back({uniform3(random, Vec3::Zero(), Vec3(12, 6, 12)),
                      uniform3(random, Vec3::Zero(), Vec3::Constant(6))});
    scene.insert(boxAt(bodies.back().centre, Vec3::Zero()));
  }
  for (int tick = 0; tick < 300; ++tick) {
    for (MoverId id = 0; id < bodies.size(); ++id) {
      Body& body = bodies[id];
      body.phase += Vec3(0.11, 0.07, 0.13);
      body.centre += uniform3(random, Vec3::Constant(-0.05), Vec3::Constant(0.05));
      const Vec3 half = (body.phase.array().sin().abs() * 0.9).matrix();
      scene.move(id, {body.centre - half, body.centre + half});
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.begins, 2500u);
  EXPECT_GT(scene.movingBegins, 200u);
}

TEST(SortAndSweep, AMoverThatGoesRoundAnotherMeetsItOnEachSideAndIsTestedAtTheCornersAlone) {
  // Unit boxes; one goes round the other on squares that miss it by a step, touch it, and cut it.
  constexpr double kStep = 1.0 / 16;  // exact in doubles: what touches touches
  const Vec3 middle(3, 7, -5);
  Watched scene({});
  std::array<MoverId, 2> ids;
  for (MoverId& id : ids) id = scene.insert(boxAt(middle, Vec3::Ones()));
  std::size_t quiet = 0, tested = 0;
  for (const MoverId goes : ids) {
    for (int around = 0; around < 3; ++around) {
      for (const int radius : {17, 16, 17, 15, 17}) {
        for (int k = 0; k < 8 * radius; ++k) {
          const int side = k / (2 * radius), along = k % (2 * radius) - radius;
          const double u = kStep * (side % 2 == 0 ? along : radius) * (side < 2 ? 1 : -1);
          const double v = kStep * (side % 2 == 0 ? -radius : along) * (side < 2 ? 1 : -1);
          Vec3 corner = middle;
          corner[around] += u;
          corner[(around + 1) % 3] += v;
          scene.move(goes, boxAt(corner, Vec3::Ones()));
          ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "radius " << radius << ", step " << k;
          if (radius < 17 || scene.sweep().counters().cellsLaid > 0) continue;
          (scene.sweep().counters().boxTests == 0 ? quiet : tested) += 1;
        }
      }
      scene.move(goes, boxAt(middle, Vec3::Ones()));
    }
  }
  EXPECT_EQ(scene.movingBegins, 12u);
  EXPECT_GT(quiet, 20 * tested);
  EXPECT_GT(tested, 12u);
}

TEST(SortAndSweep, EqualsBruteForceWhenMoversComeGoAndJump) {
  Random random(3);
  const Vec3 extent(12, 6, 12);
  Watched scene(furnishedHall(random, 700, extent));
  const auto anyBox = [&] {
    const Vec3 corner = uniform3(random, Vec3(-4, -3, -4), extent + Vec3(4, 3, 4));
    return boxAt(corner, uniform3(random, Vec3::Zero(), Vec3::Constant(3)));
  };
  std::size_t removed = 0;
  for (int tick = 0; tick < 300; ++tick) {
    while (scene.movers().size() < 25 || dice(random, 0, 2) == 0) scene.insert(anyBox());
    for (const auto& [id, box] : std::map(scene.movers())) {
      const int what = dice(random, 0, 11);
      if (what == 0) {
        scene.move(id, anyBox());
      } else if (what == 1) {
        if (dice(random, 0, 1) == 0) scene.move(id, anyBox());
        scene.remove(id);
        ++removed;
        if (dice(random, 0, 1) == 0) scene.insert(box);
      } else if (what < 8) {
        const Vec3 step = uniform3(random, Vec3::Constant(-0.1), Vec3::Constant(0.1));
        scene.move(id, {box.min + step, box.max + step});
        scene.move(id, {box.min - step, box.max - step});
      }
    }
    const MoverId passing = scene.insert(anyBox());
    if (dice(random, 0, 1) == 0) scene.remove(passing);
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(removed, 300u);
  EXPECT_GT(scene.begins, 3000u);
  EXPECT_GT(scene.movingBegins, 100u);
}

TEST(SortAndSweep, EqualsBruteForceWhenEndPointsAreTied) {
  for (const double unit : {1.0, 0.1, 1e-200, 1e200}) {
    Random random(4);
    const auto lattice = [&](int low, int high) {
      const int x = dice(random, low, high), y = dice(random, low, high),
                z = dice(random, low, high);
      return Vec3(x * unit, y * unit, z * unit);
    };
    std::vector<Box> still;
    for (int k = 0; k < 300; ++k) still.push_back(boxAt(lattice(0, 12), lattice(0, 2)));
    Watched scene(still);
    for (int k = 0; k < 30; ++k) scene.insert(boxAt(lattice(0, 12), lattice(0, 2)));
    for (int tick = 0; tick < 200; ++tick) {
      for (const auto& [id, box] : std::map(scene.movers())) {
        const Vec3 step = lattice(-1, 1);
        const Vec3 low = (box.min + step).cwiseMax(-2 * unit).cwiseMin(14 * unit);
        if (dice(random, 0, 3) > 0) scene.move(id, boxAt(low, lattice(0, 2)));
      }
      ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick << " unit " << unit;
    }
    EXPECT_GT(scene.begins, 3000u);
    EXPECT_GT(scene.movingBegins, 150u);
  }
}

TEST(SortAndSweep, EqualsBruteForceInAStackOfEqualBoxesBesideAFarOne) {
  Random random(5);
  std::vector<Box> still(200, boxAt(Vec3(1, 1, 1), Vec3(1, 1, 1)));
  for (int k = 0; k < 100; ++k) still.push_back(boxAt(Vec3(2, 0.01 * k, 1), Vec3(0, 0, 0)));
  still.push_back(boxAt(Vec3(1e12, -1e12, 5), Vec3(1, 1, 1)));
  still.push_back(boxAt(Vec3(-1e3, 0, -1e3), Vec3(2e3, 0.1, 2e3)));
  Watched scene(still);
  for (int k = 0; k < 10; ++k) {
    scene.insert(boxAt(uniform3(random, Vec3::Zero(), Vec3::Constant(3)), Vec3(0.5, 0.5, 0.5)));
  }
  for (int tick = 0; tick < 200; ++tick) {
    for (const auto& [id, box] : std::map(scene.movers())) {
      const Vec3 step = uniform3(random, Vec3::Constant(-0.2), Vec3::Constant(0.2));
      scene.move(id, {box.min + step, box.max + step});
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.begins, 3000u);
}

TEST(SortAndSweep, EqualsBruteForceOverAHugeRangeOfCoordinatesAndSizes) {
  Random random(6);
  const auto wild = [&] {
    const auto magnitude = [&] {
      const double value = std::pow(10.0, uniform(random, -6, 300));
      return dice(random, 0, 1) == 0 ? value : -value;
    };
    const double a = magnitude(), b = magnitude(), c = magnitude();
    const double d = magnitude(), e = magnitude(), f = magnitude();
    Box box;
    box.include(Vec3(a, b, c));
    box.include(Vec3(d, e, f));
    return box;
  };
  std::vector<Box> still;
  for (int k = 0; k < 150; ++k) still.push_back(wild());
  still.push_back(boxAt(Vec3::Constant(-1.7e308), Vec3::Zero()));
  still.push_back(boxAt(Vec3::Constant(1.7e308), Vec3::Zero()));
  Watched scene(still);
  for (int k = 0; k < 20; ++k) scene.insert(wild());
  for (int tick = 0; tick < 200; ++tick) {
    for (const auto& [id, box] : std::map(scene.movers())) {
      if (dice(random, 0, 2) == 0) scene.move(id, wild());
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.begins, 2000u);
}

TEST(SortAndSweep, TakesMoversMuchLargerThanTheCellsOrTheScene) {
  Random random(7);
  const Vec3 extent(60, 9, 60);
  Watched scene(furnishedHall(random, 3000, extent));
  for (int k = 0; k < 4; ++k) {
    scene.insert(boxAt(uniform3(random, Vec3::Zero(), extent), Vec3(30, 5, 20)));
  }
  scene.insert(boxAt(Vec3::Constant(-1e9), Vec3::Constant(2e9)));
  for (int tick = 0; tick < 200; ++tick) {
    for (const auto& [id, box] : std::map(scene.movers())) {
      const Vec3 step = uniform3(random, Vec3::Constant(-1), Vec3::Constant(1));
      scene.move(id, {box.min + step, box.max + step});
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.begins, 3000u);
}

TEST(SortAndSweep, WorksWithoutStillBoxes) {
  Random random(8);
  Watched scene({});
  for (int k = 0; k < 60; ++k) {
    scene.insert(boxAt(uniform3(random, Vec3::Zero(), Vec3::Constant(5)), Vec3::Ones()));
  }
  for (int tick = 0; tick < 200; ++tick) {
    for (const auto& [id, box] : std::map(scene.movers())) {
      const Vec3 step = uniform3(random, Vec3::Constant(-0.1), Vec3::Constant(0.1));
      scene.move(id, {box.min + step, box.max + step});
    }
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_GT(scene.movingBegins, 300u);
}

TEST(SortAndSweep, BoxesThatShareOnlyABoundaryPointOverlap) {
  Watched scene({boxAt(Vec3::Zero(), Vec3::Ones())});
  const MoverId id = scene.insert(boxAt(Vec3::Ones(), Vec3::Ones()));
  scene.updateAndCheck();
  EXPECT_EQ(scene.sweep().pairCount(), 1u);
  const double apart = std::nextafter(1.0, 2.0);
  scene.move(id, boxAt(Vec3(1, apart, 1), Vec3::Ones()));
  scene.updateAndCheck();
  EXPECT_EQ(scene.sweep().ended().size(), 1u);
  scene.move(id, boxAt(Vec3(1, 1, 1), Vec3::Ones()));
  scene.updateAndCheck();
  EXPECT_EQ(scene.sweep().begun().size(), 1u);
}

TEST(SortAndSweep, TellsThePairsOfARemovedMoverAsEnded) {
  Watched scene({boxAt(Vec3::Zero(), Vec3::Ones())});
  const MoverId a = scene.insert(boxAt(Vec3::Zero(), Vec3::Ones()));
  const MoverId b = scene.insert(boxAt(Vec3::Zero(), Vec3::Ones()));
  scene.updateAndCheck();
  scene.remove(a);
  const MoverId c = scene.insert(boxAt(Vec3::Zero(), Vec3::Ones()));
  EXPECT_NE(c, a) << "the id is free only after the update that tells its end";
  scene.updateAndCheck();
  const Pairs ended(scene.sweep().ended().begin(), scene.sweep().ended().end());
  EXPECT_EQ(ended, (Pairs{{a, 0, false}, {a, b, true}}));
  EXPECT_TRUE(scene.sweep().partners(a).empty());
  EXPECT_EQ(scene.insert(boxAt(Vec3::Zero(), Vec3::Ones())), a);
}

TEST(SortAndSweep, SaysNothingOfAPairThatComesAndGoesWithinAnUpdate) {
  Watched scene({boxAt(Vec3::Zero(), Vec3::Ones())});
  const MoverId id = scene.insert(boxAt(Vec3::Constant(5), Vec3::Ones()));
  scene.updateAndCheck();
  scene.move(id, boxAt(Vec3::Zero(), Vec3::Ones()));
  scene.move(id, boxAt(Vec3::Constant(5), Vec3::Ones()));
  scene.updateAndCheck();
  EXPECT_TRUE(scene.sweep().begun().empty());
  EXPECT_TRUE(scene.sweep().ended().empty());
}

TEST(SortAndSweep, RefusesBoxesThatAreEmptyOrNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const Box good = boxAt(Vec3::Zero(), Vec3::Ones());
  const std::vector<Box> bad{Box{},
                             boxAt(Vec3(0, nan, 0), Vec3::Ones()),
                             {Vec3(0, 0, -infinity), Vec3::Ones()},
                             {Vec3(0, 2, 0), Vec3::Ones()}};
  SortAndSweep sweep(std::vector<Box>{good});
  const MoverId id = sweep.insert(good);
  sweep.update();
  for (const Box& box : bad) {
    EXPECT_THROW(SortAndSweep(std::vector<Box>{good, box}), std::invalid_argument);
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
  Watched scene(furnishedHall(random, 500, Vec3(10, 3, 10)));
  for (int k = 0; k < 20; ++k) {
    scene.insert(boxAt(uniform3(random, Vec3::Zero(), Vec3(10, 3, 10)), Vec3::Ones()));
  }
  scene.updateAndCheck();
  EXPECT_GT(scene.sweep().counters().cellsLaid, 0u);
  EXPECT_GT(scene.sweep().pairCount(), 50u);
  for (const auto& [id, box] : scene.movers()) scene.sweep().move(id, box);
  scene.updateAndCheck();
  EXPECT_EQ(scene.sweep().counters().exchanges, 0u);
  EXPECT_EQ(scene.sweep().counters().cellsLaid, 0u);
  EXPECT_EQ(scene.sweep().counters().boxTests, 0u);
}

TEST(SortAndSweep, LaysNoCellsForWhatStandsHoweverThinOrFarAwayItIs) {
  const Box still = boxAt({0, 0, 0}, {1, 1, 1});
  for (const Vec3& size : {Vec3(1, 0, 1), Vec3(0, 0, 0), Vec3(1, 1, 1)}) {
    for (const double far : {0.0, 1e17}) {
      SortAndSweep sweep(std::span(&still, 1));
      const Box box = boxAt({far, 0, 0}, size);
      const MoverId id = sweep.insert(box);
      sweep.update();
      for (int tick = 0; tick < 100; ++tick) {
        sweep.move(id, box);
        sweep.update();
        EXPECT_EQ(sweep.counters().cellsLaid, 0U) << "tick " << tick;
      }
    }
  }
}

TEST(SortAndSweep, AfterAllHaveJumpedTheyAreStrangersAgain) {
  const Box slab = boxAt({-5000, -1, -5000}, {10000, 1, 10000});
  SortAndSweep sweep(std::span(&slab, 1));
  constexpr int kMovers = 100;
  const auto boxOf = [](int k, double x) { return boxAt({x + 3 * k, 0.5, 0}, {1, 1, 1}); };
  for (int k = 0; k < kMovers; ++k) sweep.insert(boxOf(k, 0));
  sweep.update();
  for (int tick = 1; tick < 5; ++tick) {
    for (MoverId k = 0; k < kMovers; ++k)
      sweep.move(k, boxOf(static_cast<int>(k), 100 + 0.001 * tick));
    sweep.update();
  }
  EXPECT_LE(sweep.counters().boxTests, 4U * kMovers);  // those beside one another, not all of them
}

TEST(SortAndSweep, AMoverThatWasRemovedCannotBeMovedNotEvenToWhereItIs) {
  const Box box = boxAt({0.5, 0.5, 0.5}, {1, 1, 1});
  SortAndSweep sweep(std::span(&box, 1));
  const MoverId id = sweep.insert(box);
  sweep.update();
  sweep.remove(id);
  EXPECT_THROW(sweep.move(id, box), std::invalid_argument);
  EXPECT_THROW(sweep.remove(id), std::invalid_argument);
}

TEST(SortAndSweep, CountsTheEndPointsThatAMoverPasses) {
  // Ten posts in a row; a walker passes both ends of the first five on x.
  std::vector<Box> posts;
  for (int k = 0; k < 10; ++k) posts.push_back(boxAt(Vec3(k, 0, 0), Vec3(0.1, 2, 0.1)));
  SortAndSweep sweep(posts);
  const MoverId id = sweep.insert(boxAt(Vec3(-1, 0.5, 0), Vec3(0.05, 1, 0.05)));
  sweep.update();
  std::uint64_t exchanges = 0, begins = 0, ends = 0;
  for (int tick = 1; tick <= 55; ++tick) {
    sweep.move(id, boxAt(Vec3(-1 + 0.1 * tick, 0.5, 0), Vec3(0.05, 1, 0.05)));
    sweep.update();
    exchanges += sweep.counters().exchanges;
    begins += sweep.begun().size();
    ends += sweep.ended().size();
  }
  EXPECT_EQ(begins, 5u);
  EXPECT_EQ(ends, 5u);
  EXPECT_LE(exchanges, 10u);  // those of a cell are not passed while it is entered
  EXPECT_GE(exchanges, 8u);
}

/// Exchanges and box tests a mover and tick, among `count` boxes of one density.
double workAMover(std::size_t count) {
  Random random(10);
  const double side = std::sqrt(static_cast<double>(count) / 2.0);
  SortAndSweep sweep(furnishedHall(random, count, Vec3(side, 3, side)));
  std::vector<Box> boxes;
  std::vector<MoverId> ids;
  for (int k = 0; k < 20; ++k) {
    boxes.push_back(
        boxAt(uniform3(random, Vec3::Zero(), Vec3(side, 1, side)), Vec3(0.6, 1.75, 0.6)));
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
    work += sweep.counters().exchanges + sweep.counters().boxTests;
  }
  return static_cast<double>(work) / 200 / 20;
}

TEST(SortAndSweep, WorkAMoverDoesNotGrowWithTheScene) {
  const double small = workAMover(1000);
  const double large = workAMover(100000);
  EXPECT_GT(small, 0.1);
  EXPECT_LT(large, 1.5 * small);
  EXPECT_LT(large, 20);
}

TEST(SortAndSweep, AWalkerOnAStraightCourseSeldomHasItsCellLaidAnew) {
  Random random(12);
  SortAndSweep sweep(furnishedHall(random, 20000, Vec3(100, 3, 100)));
  std::vector<Box> boxes;
  for (int k = 0; k < 50; ++k) {
    boxes.push_back(boxAt(uniform3(random, Vec3(5, 0, 5), Vec3(80, 1, 80)), Vec3(0.6, 1.75, 0.6)));
    sweep.insert(boxes.back());
  }
  sweep.update();
  std::uint64_t laid = 0, most = 0, exchanges = 0;
  for (int tick = 0; tick < 300; ++tick) {
    for (MoverId id = 0; id < boxes.size(); ++id) {
      const Vec3 step(0.02, 0, 0.015);
      boxes[id] = {boxes[id].min + step, boxes[id].max + step};
      sweep.move(id, boxes[id]);
    }
    sweep.update();
    laid += sweep.counters().cellsLaid;
    most = std::max(most, sweep.counters().cellsLaid);
    exchanges += sweep.counters().exchanges;
  }
  EXPECT_GT(exchanges, 1000u);
  EXPECT_GT(laid, 50u);
  EXPECT_LT(laid, 300u * 50 / 20) << "a cell lasts for more than 20 ticks";
  EXPECT_LT(most, 10u) << "few movers have theirs laid in one tick";
}

TEST(SortAndSweep, HoldsFewBytesBesidesTheBoxes) {
  Random random(13);
  const SortAndSweep sweep(furnishedHall(random, 50000, Vec3(150, 3, 150)));
  EXPECT_GT(sweep.bytesBesidesStillBoxes(), 50000u * 16) << "an entry in a cell each at the least";
  EXPECT_LT(sweep.bytesBesidesStillBoxes(), 50000u * 64);
}

TEST(SortAndSweep, GivesTheSameAnswersWhateverTheOrderOfTheStillBoxes) {
  Random random(11);
  std::vector<Box> still = furnishedHall(random, 400, Vec3(10, 3, 10));
  SortAndSweep sweep(still);
  const Box box = boxAt(Vec3(3, 0, 3), Vec3(2, 2, 2));
  const MoverId id = sweep.insert(box);
  sweep.update();
  const auto last = static_cast<std::uint32_t>(still.size() - 1);
  std::reverse(still.begin(), still.end());
  SortAndSweep reversed(still);
  reversed.insert(box);
  reversed.update();
  ASSERT_EQ(sweep.pairCount(), reversed.pairCount());
  ASSERT_GT(sweep.pairCount(), 5u);
  const auto a = sweep.partners(id), b = reversed.partners(id);
  for (std::size_t k = 0; k < a.size(); ++k) EXPECT_EQ(a[k].id, last - b[a.size() - 1 - k].id);
}

}  // namespace
}  // namespace enfilade::collision
