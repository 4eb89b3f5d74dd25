// Random moves at 0.01 to 1000 m/s among sheets without thickness, slivers and panes; every tick of
// every avatar is held to its closed cell, every sixteenth also to the exact verdict on everything.
//
//   thin_things_bench [MOVES [SEED]]
#include <cstdio>
#include <cstdlib>

#include "tests/scene/thin_things.hpp"

namespace {

using namespace enfilade::scene::testing;

struct Totals {
  int moves = 0, outside = 0, penetrating = 0;
};

void run(const char* name, bool sliced, double size, std::uint64_t seed, int moves, Totals& all) {
  Builder b;
  const std::vector<Cell> cells = gridOfCells(b, 4, size, 3, sliced);
  CellTrial trial(b.model, cells);
  trial.spawn();
  Seeded random(seed);
  trial.randomMoves(random, moves / static_cast<int>(cells.size()));
  std::printf("| %-18s | %7d | %6.1f %% | %7d | %11d |\n", name, trial.moves,
              100.0 * trial.blocked / trial.moves, trial.outside, trial.penetrating);
  all.moves += trial.moves;
  all.outside += trial.outside;
  all.penetrating += trial.penetrating;
}

}  // namespace

int main(int argc, char** argv) {
  const int moves = argc > 1 ? std::atoi(argv[1]) : 100000;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoi(argv[2]) : 1);
  std::printf(
      "| cells              |   moves | stopped  | outside | penetrating |\n"
      "|---|---|---|---|---|\n");
  Totals all;
  run("sheets, 1.4 m", false, 1.4, seed, moves / 4, all);
  run("slivers, 1.4 m", true, 1.4, seed + 1, moves / 4, all);
  run("sheets, 0.7 m", false, 0.7, seed + 2, moves / 4, all);
  run("slivers, 4 m", true, 4, seed + 3, moves / 4, all);
  std::printf("%d moves, %d outside their cell, %d penetrating\n", all.moves, all.outside,
              all.penetrating);
  return all.outside + all.penetrating == 0 ? 0 : 3;
}
