// Random moves at 0.01 to 1000 m/s among sheets of zero thickness, slivers, panes, gaps and stairs.
// Every tick checks each avatar against its closed cell, every sixteenth also against the exact
// verdict on everything.
//
//   thin_geometry_bench [MOVES [SEED]]
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "tests/scene/thin_geometry.hpp"

namespace {

using namespace enfilade::scene::testing;

struct Totals {
  int moves = 0, outside = 0, penetrating = 0;
};

void run(const char* name, std::uint64_t seed, int moves, Totals& all,
         const std::function<std::vector<Cell>(Builder&, Seeded&)>& build) {
  Builder b;
  Seeded random(seed);
  const std::vector<Cell> cells = build(b, random);
  CellFixture fixture(b.model, cells);
  fixture.spawn();
  fixture.moveRandomly(random, moves / static_cast<int>(cells.size()));
  std::printf("| %-18s | %7d | %6.1f %% | %7d | %11d |\n", name, fixture.moves,
              100.0 * fixture.blocked / fixture.moves, fixture.outside, fixture.penetrating);
  all.moves += fixture.moves;
  all.outside += fixture.outside;
  all.penetrating += fixture.penetrating;
}

std::vector<Cell> makeStairs(Builder& b, Seeded& random) {
  std::vector<Cell> cells;
  for (int i = 0; i < 16; ++i)
    cells.push_back(addStairCell(b, "stair" + std::to_string(i),
                                 0.02 * std::pow(35, random.drawUniform(0, 1)),
                                 0.02 * std::pow(35, random.drawUniform(0, 1)), 9, 2.5 * i));
  return cells;
}

}  // namespace

int main(int argc, char** argv) {
  const int moves = argc > 1 ? std::atoi(argv[1]) : 100000;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoi(argv[2]) : 1);
  std::printf(
      "| cells              |   moves | stopped  | outside | penetrating |\n"
      "|---|---|---|---|---|\n");
  Totals all;
  const auto grid = [](double size, bool sliced) {
    return [=](Builder& b, Seeded&) { return addGridOfCells(b, 4, size, 3, sliced); };
  };
  const int each = moves / 7;
  run("sheets, 1.4 m", seed, each, all, grid(1.4, false));
  run("sheets, 0.7 m", seed + 1, each, all, grid(0.7, false));
  run("slivers, 1.4 m", seed + 2, each, all, grid(1.4, true));
  run("slivers, 4 m", seed + 3, each, all, grid(4, true));
  run("panes of 1 mm", seed + 4, each, all,
      [](Builder& b, Seeded& random) { return addPaneRooms(b, 8, random); });
  run("gaps of 1 mm more", seed + 5, each, all,
      [](Builder& b, Seeded&) { return addGapRooms(b, 8, 0.601); });
  run("stairs", seed + 6, each, all, makeStairs);
  std::printf("%d moves, %d outside their cell, %d penetrating\n", all.moves, all.outside,
              all.penetrating);
  return all.outside + all.penetrating == 0 ? 0 : 3;
}
