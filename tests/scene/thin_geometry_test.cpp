// Random moves at 0.01 to 1000 m/s among thin obstacles. Each scene is a set of closed cells: an
// avatar in another cell than before has tunnelled.
#include "tests/scene/thin_geometry.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/sanitized.hpp"

namespace enfilade::scene {
namespace {

using namespace testing;

// Moves in each of the sixteen runs below: 1e5 in all. Sanitizers run slowly and get fewer.
constexpr int kMovesOfOne = tests::kSanitized ? 600 : 6400;

/// The geometry that encloses the avatars, and the seed of the run.
struct Shut {
  const char* in;
  std::uint64_t seed;
};

void PrintTo(const Shut& shut, std::ostream* to) {
  *to << shut.in << ", seed " << shut.seed;
}

std::vector<Cell> makeCells(const Shut& shut, Builder& b, Seeded& random) {
  const std::string in = shut.in;
  if (in == "Sheets") return addGridOfCells(b, 3, shut.seed % 2 ? 1.4 : 0.7, 3, false);
  if (in == "Slivers") return addGridOfCells(b, 3, shut.seed % 2 ? 1.4 : 4, 3, true);
  if (in == "Panes") return addPaneRooms(b, 4, random);
  if (in == "Gaps") return addGapRooms(b, 4, 0.601);
  std::vector<Cell> stairs;  // from 1:35 to 35:1, log-uniform
  for (int i = 0; i < 8; ++i) {
    const double riser = 0.02 * std::pow(35, random.drawUniform(0, 1));
    const double tread = 0.02 * std::pow(35, random.drawUniform(0, 1));
    stairs.push_back(addStairCell(b, "stair" + std::to_string(i), riser, tread, 9, 2.5 * i));
  }
  return stairs;
}

class ThinGeometry : public ::testing::TestWithParam<Shut> {};

TEST_P(ThinGeometry, AreNotCrossedByRandomMovesOfAnySpeed) {
  Builder b;
  Seeded random(GetParam().seed);
  const std::vector<Cell> cells = makeCells(GetParam(), b, random);
  CellFixture run(b.model, cells);
  run.spawn();
  run.moveRandomly(random, kMovesOfOne / static_cast<int>(cells.size()));
  EXPECT_EQ(run.outside, 0);
  EXPECT_EQ(run.penetrating, 0);
  EXPECT_GE(run.moves, kMovesOfOne * 9 / 10);
  EXPECT_GT(run.blocked, run.moves / 20) << "many moves should hit an obstacle";
  EXPECT_LT(run.blocked, run.moves * 19 / 20);
}

std::vector<Shut> listShutCells() {
  std::vector<Shut> all;
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
    for (const char* in : {"Sheets", "Slivers", "Panes", "Gaps", "Stairs"})
      all.push_back({in, seed});
  all.push_back({"Stairs", 4});
  return all;
}

INSTANTIATE_TEST_SUITE_P(All, ThinGeometry, ::testing::ValuesIn(listShutCells()),
                         [](const auto& shut) {
                           return shut.param.in + std::to_string(shut.param.seed);
                         });

TEST(ThinGaps, ADoorGapAMillimetreWiderIsPassedAndOneNarrowerIsNot) {
  // Two rooms of 3 m with a gap in the wall of zero thickness between them. The prism is 0.6 m wide
  // along the gap, and the contact offset is kept on both sides.
  for (const double wider : {0.001, 0.002, -0.001}) {
    for (const double speed : {0.3, 1.4, 40.0}) {
      Builder b;
      const double gap = 0.6 + wider;
      b.addBox("floor", {-4, -0.2, -2}, {4, 0, 2});
      b.addSheet("left", {{0, 0, -2}, {0, 0, -0.5 * gap}, {0, 3, -0.5 * gap}, {0, 3, -2}});
      b.addSheet("right", {{0, 0, 0.5 * gap}, {0, 0, 2}, {0, 3, 2}, {0, 3, 0.5 * gap}});
      World world(std::make_shared<const Scene>(b.model));
      ASSERT_FALSE(submitAvatarCommand(world, {"ann", Spawn{{-2, 0, 0}}, 0}));
      ASSERT_FALSE(submitAvatarCommand(world, {"ann", Walk{{{2, 0, 0}}, speed}, 0}));
      for (int i = 0; i < 900; ++i) {
        const TickReport report = tickWorld(world);
        ASSERT_EQ(report.maxPenetration, 0);
        if (i > 3 && report.idle) break;
      }
      EXPECT_EQ(countPenetrations(world), 0);
      const double x = world.snapshot()->avatars[0].footPosition.x();
      if (wider > 0) {
        EXPECT_NEAR(x, 2, 1e-3) << speed;
      } else {
        EXPECT_LT(x, 0) << speed;
      }
    }
  }
}

TEST(ThinGaps, AnOffCentreAvatarSlidesIntoTheGap) {
  int through = 0;
  for (int i = -4; i <= 4; ++i) {
    Builder b;
    addGapRooms(b, 1, 0.601);
    World world(std::make_shared<const Scene>(b.model));
    ASSERT_FALSE(submitAvatarCommand(world, {"ann", Spawn{{-0.8, 0.01, 0.01 * i}}, 0}));
    tickWorld(world);
    ASSERT_FALSE(submitAvatarCommand(world, {"ann", Drive{{1.4, 0, 0}}, 0}));
    for (int k = 0; k < 150; ++k) ASSERT_EQ(tickWorld(world).maxPenetration, 0);
    EXPECT_EQ(countPenetrations(world), 0);
    through += world.snapshot()->avatars[0].footPosition.x() > 0.5;
  }
  EXPECT_GE(through, 5) << "of 9";
}

TEST(ThinGeometryOracle, TheOracleFindsAPointInside) {
  // The avatar is placed into a sheet by hand: the check above must find it.
  Builder b;
  b.addBox("floor", {-4, -0.2, -4}, {4, 0, 4});
  b.addSheet("pane", {{1, 0, -4}, {1, 0, 4}, {1, 3, 4}, {1, 3, -4}});
  World world(std::make_shared<const Scene>(b.model));
  ASSERT_FALSE(submitAvatarCommand(world, {"ann", Spawn{{0, 0, 0}}, 0}));
  tickWorld(world);
  EXPECT_EQ(countPenetrations(world), 0);
  auto moved = std::make_shared<Snapshot>(*world.snapshot());
  collision::FeatureCache cache;
  const AvatarSnapshot& ann = moved->avatars[0];
  const std::vector<Vec3> pane{{1, 0, -4}, {1, 0, 4}, {1, 3, 4}};
  EXPECT_EQ(collision::computeSeparation(placeAvatarPart(ann.shape->parts[0], {0.9, 0.1, 0}),
                                         {pane}, cache)
                .verdict,
            collision::Verdict::penetrating);
}

}  // namespace
}  // namespace enfilade::scene
