#include "tests/benchmarks/broad_phase_runs.hpp"

#include <malloc.h>

#include "tests/benchmarks/measurement.hpp"

namespace enfilade::benchmarks {
namespace {

constexpr int kTurns = 6;
constexpr int kRuns = 3;
constexpr std::size_t kMinTicks = 4;
constexpr double kLongToBuild = 0.5;  // seconds

double readHeapBytes() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

BroadPhaseRun build(const BroadPhaseMethod& method, std::span<const Aabb> staticBoxes) {
  BroadPhaseRun run;
  run.method = &method;
  const double before = readHeapBytes();
  const auto start = Clock::now();
  run.phase = method.make(staticBoxes);
  run.buildSeconds = measureSecondsSince(start);
  const double bytes =
      readHeapBytes() - before + static_cast<double>(run.phase->countHiddenBytes());
  run.bytesAnObject = bytes / static_cast<double>(staticBoxes.size());
  if (!run.phase->readsGivenBoxes()) run.bytesAnObject -= sizeof(Aabb);
  return run;
}

/// Runs some ticks of one method. The first tick finds the caches full of other methods' data (and
/// the very first inserts the dynamic boxes), so it is not timed.
void turn(BroadPhaseRun& run, const RecordedBoxes& recorded, double secondsAMethod) {
  const std::size_t until =
      std::min(recorded.boxes.size(), run.tick + recorded.boxes.size() / kTurns + 1);
  const std::size_t first = run.tick;
  for (; run.tick < until; ++run.tick) {
    if (run.tick > kMinTicks && run.spent > secondsAMethod) return;
    PairTally tally;
    const auto start = Clock::now();
    run.phase->runTick(recorded.boxes[run.tick], tally);
    const double seconds = measureSecondsSince(start);
    run.spent += seconds;
    if (run.tick == 0) run.firstTick = seconds;
    run.microseconds.push_back(run.tick > first ? 1e6 * seconds : 0);
    if (!tally.isSameAs(recorded.pairs[run.tick])) ++run.wrong;
  }
}

void runInTurns(std::vector<BroadPhaseRun>& runs, const RecordedBoxes& recorded,
                double secondsAMethod) {
  for (int k = 0; k < kTurns; ++k) {
    for (BroadPhaseRun& run : runs) turn(run, recorded, secondsAMethod);
  }
  for (BroadPhaseRun& run : runs) run.phase.reset();
}

/// Takes the minimum of two runs of a method, tick by tick.
void takeMinima(BroadPhaseRun& best, const BroadPhaseRun& again) {
  best.buildSeconds = std::min(best.buildSeconds, again.buildSeconds);
  best.firstTick = std::min(best.firstTick, again.firstTick);
  best.wrong = std::max(best.wrong, again.wrong);
  const std::size_t both = std::min(best.microseconds.size(), again.microseconds.size());
  for (std::size_t k = 0; k < both; ++k) {
    best.microseconds[k] = std::min(best.microseconds[k], again.microseconds[k]);
  }
}

}  // namespace

std::vector<BroadPhaseRun> runMethods(std::span<const BroadPhaseMethod* const> methods,
                                      std::span<const Aabb> staticBoxes,
                                      const RecordedBoxes& recorded, double secondsAMethod) {
  std::vector<BroadPhaseRun> best;
  for (const BroadPhaseMethod* method : methods) best.push_back(build(*method, staticBoxes));
  runInTurns(best, recorded, secondsAMethod);
  for (int k = 1; k < kRuns; ++k) {
    std::vector<BroadPhaseRun> again;
    for (const BroadPhaseRun& run : best) {
      if (run.buildSeconds < kLongToBuild) again.push_back(build(*run.method, staticBoxes));
    }
    runInTurns(again, recorded, secondsAMethod);
    for (const BroadPhaseRun& run : again) {
      takeMinima(
          *std::ranges::find(best, run.method, [](const BroadPhaseRun& b) { return b.method; }),
          run);
    }
  }
  return best;
}

const char* getKindName(BroadPhaseMethod::Kind kind) {
  if (kind == BroadPhaseMethod::Kind::ours) return "ours";
  return kind == BroadPhaseMethod::Kind::approach ? "approach" : "peer";
}

}  // namespace enfilade::benchmarks
