// Random moves at 0.01 to 1000 m/s among things that are easily slipped through. Each scene is a
// set of closed cells: whoever is in another cell than before has crossed something.
#include "tests/scene/thin_things.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace enfilade::scene {
namespace {

using namespace testing;

TEST(ThinThings, SheetsOfNoThicknessKeepEverybodyInTheirCell) {
  for (const bool sliced : {false, true}) {
    Builder b;
    const std::vector<Cell> cells = gridOfCells(b, 3, 1.4, 3, sliced);
    CellTrial run(b.model, cells);
    run.spawn();
    Seeded random(sliced ? 2 : 1);
    run.randomMoves(random, 250);
    EXPECT_EQ(run.outside, 0);
    EXPECT_EQ(run.penetrating, 0);
    EXPECT_GT(run.blocked, run.moves / 10) << "most moves should meet something";
    EXPECT_LT(run.blocked, run.moves * 19 / 20);
  }
}

TEST(ThinThings, PanesOfAMillimetreAndClutterAreNotCrossed) {
  Builder b;
  std::vector<Cell> cells;
  Seeded random(3);
  for (int i = 0; i < 4; ++i) {
    const Vec3 min{3.0 * i, 0, 0}, max{3.0 * i + 2.999, 3, 3};
    b.box("floor" + std::to_string(i), min - Vec3(0.1, 0.2, 0.1), {max.x() + 0.1, 0, 3.1});
    b.box("roof" + std::to_string(i), {min.x() - 0.1, 3, -0.1}, max + Vec3(0.1, 0.001, 0.1));
    b.box("south" + std::to_string(i), min - Vec3(0, 0, 0.001), {max.x(), 3, 0});
    b.box("north" + std::to_string(i), {min.x(), 0, 3}, max + Vec3(0, 0, 0.001));
    b.box("west" + std::to_string(i), min - Vec3(0.001, 0, 0), {min.x(), 3, 3});
    b.box("east" + std::to_string(i), {max.x(), 0, 0}, max + Vec3(0.001, 0, 0));
    for (int k = 0; k < 12; ++k) {  // ledges, needles and plates, not where one enters
      const double x = min.x() + random.uniform(0, 2.9), z = random.uniform(0, 2.9);
      if (std::abs(x - min.x() - 1.5) < 0.6 && std::abs(z - 1.5) < 0.6) continue;
      const double y = random.uniform(0, 2);
      b.box("bit" + std::to_string(12 * i + k), {x, y, z},
            {x + random.uniform(1e-4, 0.1), y + random.uniform(1e-4, 0.4), z + 0.001});
    }
    cells.push_back({min, max});
  }
  CellTrial run(b.model, cells);
  run.spawn();
  run.randomMoves(random, 350);
  EXPECT_EQ(run.outside, 0);
  EXPECT_EQ(run.penetrating, 0);
}

TEST(ThinThings, ADoorGapAMillimetreWiderIsPassedAndOneNarrowerIsNot) {
  // Two rooms of 3 m, a wall of no thickness between them with a gap in its middle. The prism is
  // 0.6 m wide along the gap, and epsilon is kept on both sides.
  for (const double wider : {0.002, -0.001}) {
    for (const double speed : {0.3, 1.4, 40.0}) {
      Builder b;
      const double gap = 0.6 + wider;
      b.box("floor", {-4, -0.2, -2}, {4, 0, 2});
      b.sheet("left", {{0, 0, -2}, {0, 0, -0.5 * gap}, {0, 3, -0.5 * gap}, {0, 3, -2}});
      b.sheet("right", {{0, 0, 0.5 * gap}, {0, 0, 2}, {0, 3, 2}, {0, 3, 0.5 * gap}});
      World world(std::make_shared<const Scene>(b.model));
      ASSERT_FALSE(submit(world, {"ann", Spawn{{-2, 0, 0}}, 0}));
      ASSERT_FALSE(submit(world, {"ann", Walk{{{2, 0, 0}}, speed}, 0}));
      for (int i = 0; i < 900; ++i) {
        const TickReport report = tick(world);
        ASSERT_EQ(report.worstPenetration, 0);
        if (i > 3 && report.idle) break;
      }
      EXPECT_EQ(penetrations(world), 0);
      const double x = world.snapshot()->avatars[0].feet.x();
      if (wider > 0) {
        EXPECT_NEAR(x, 2, 1e-3) << speed;
      } else {
        EXPECT_LT(x, 0) << speed;
      }
    }
  }
}

/// A straight flight of sheets, without thickness, between two side walls of sheets.
std::vector<Cell> stairCell(Builder& b, double riser, double tread, int steps) {
  const double top = riser * steps, end = tread * steps;
  const auto level = [&](int i, double y) {
    const double x = tread * i;
    b.sheet("tread" + std::to_string(i),
            {{x, y, -1}, {x + tread, y, -1}, {x + tread, y, 1}, {x, y, 1}});
  };
  for (int i = 0; i < steps; ++i) {
    const double x = tread * i, y = riser * (i + 1);
    level(i, y);
    b.sheet("riser" + std::to_string(i),
            {{x, y - riser, -1}, {x, y, -1}, {x, y, 1}, {x, y - riser, 1}});
  }
  b.sheet("below", {{-2, 0, -1}, {0, 0, -1}, {0, 0, 1}, {-2, 0, 1}});
  b.sheet("above", {{end, top, -1}, {end + 2, top, -1}, {end + 2, top, 1}, {end, top, 1}});
  for (const double z : {-1.0, 1.0})
    b.sheet("side", {{-2, -1, z}, {end + 2, -1, z}, {end + 2, top + 4, z}, {-2, top + 4, z}});
  for (const double x : {-2.0, end + 2})
    b.sheet("end", {{x, -1, -1}, {x, top + 4, -1}, {x, top + 4, 1}, {x, -1, 1}});
  b.sheet("roof",
          {{-2, top + 4, -1}, {end + 2, top + 4, -1}, {end + 2, top + 4, 1}, {-2, top + 4, 1}});
  return {{{-2, 0, -1}, {end + 2, top + 4, 1}}};
}

/// How high the stair is at x: nobody's feet are lower than under all of their soles.
double stairAt(double x, double riser, double tread, int steps) {
  return riser * std::max(0.0, std::min(double(steps), std::floor(x / tread) + 1));
}

TEST(ThinThings, StairsOfAllPitchesAreNotFallenThrough) {
  Seeded random(7);
  for (const auto& [riser, tread] : {std::pair{0.05, 0.6},
                                     {0.17, 0.29},
                                     {0.2, 0.2},
                                     {0.28, 0.1},
                                     {0.29, 0.02},
                                     {0.31, 0.3},
                                     {0.6, 0.25}}) {
    Builder b;
    std::vector<Cell> cells = stairCell(b, riser, tread, 9);
    cells[0].min.y() = 0;
    CellTrial run(b.model, cells);
    Spawn spawn{{-1, 0.01, 0}};
    ASSERT_FALSE(submit(run.world, {run.name(0), spawn, 0}));
    for (int k = 0; k < 220; ++k) {
      if (k % 5 == 1) run.command(0, Drive{randomVelocity(random, false)});
      if (k % 40 == 20) run.command(0, Jump{0.7, Vec3(random.uniform(-5, 5), 0, 0)});
      run.step(k % 16 == 0);
      // Under the middle of the soles something holds, whatever the way was.
      const Vec3 feet = run.world.snapshot()->avatars[0].feet;
      ASSERT_GT(feet.y() + 1e-9, stairAt(feet.x(), riser, tread, 9))
          << riser << " / " << tread << " at " << k;
    }
    EXPECT_EQ(run.outside, 0) << riser << " / " << tread;
    EXPECT_EQ(run.penetrating, 0) << riser << " / " << tread;
  }
}

TEST(ThinThings, TheJudgeItselfFindsWhatIsInside) {
  // A world whose avatar is put into a sheet by hand: the twin above must see it.
  Builder b;
  b.box("floor", {-4, -0.2, -4}, {4, 0, 4});
  b.sheet("pane", {{1, 0, -4}, {1, 0, 4}, {1, 3, 4}, {1, 3, -4}});
  World world(std::make_shared<const Scene>(b.model));
  ASSERT_FALSE(submit(world, {"ann", Spawn{{0, 0, 0}}, 0}));
  tick(world);
  EXPECT_EQ(penetrations(world), 0);
  auto moved = std::make_shared<Snapshot>(*world.snapshot());
  collision::FeatureCache cache;
  const AvatarView& ann = moved->avatars[0];
  const std::vector<Vec3> pane{{1, 0, -4}, {1, 0, 4}, {1, 3, 4}};
  EXPECT_EQ(collision::decide(bodyAt(ann.shape->parts[0], {0.9, 0.1, 0}), {pane}, cache).verdict,
            collision::Verdict::penetrating);
}

}  // namespace
}  // namespace enfilade::scene
