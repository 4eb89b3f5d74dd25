// All broad phases on one motion: ours, the other approaches of the seed, the peers.
//
//   collision_broad_phase [--quick] [--out FILE] [--only PART_OF_A_NAME]
//
// The workload is building_workload.hpp's. Every method gets the same boxes, in turns of some
// dozens of ticks, so that a disturbance of the machine meets all of them. A tick is timed from the
// new boxes to all pairs told; its pairs are compared with those of a method of its own (PairTruth)
// by number and sum of mixed ids, every tick. A method stops when its time for a size is used up.

#include <malloc.h>

#include "tests/benchmarks/broad_phase_method.hpp"
#include "tests/benchmarks/building_workload.hpp"
#include "tests/benchmarks/measurement.hpp"

namespace {

using namespace enfilade::benchmarks;
namespace collision = enfilade::collision;

constexpr int kTurns = 6;

struct Effort {
  std::size_t mostObjects;
  int ticks;
  double secondsAMethod;  ///< for ticks, per size; at least kLeastTicks are made all the same
  std::size_t slowShare;  ///< methods with a limit of objects are left out above limit / slowShare
};
constexpr int kLeastTicks = 4;

/// The pairs of a tick by candidates: for each mover all still boxes within a metre of where it was
/// when they were last gathered. Gathers from a list sorted on x, the one thing it has of a method.
class PairTruth {
 public:
  explicit PairTruth(std::span<const Box> still) : still_(still) {
    for (std::uint32_t s = 0; s < still.size(); ++s) byX_.emplace_back(still[s].min.x(), s);
    for (const Box& box : still) widest_ = std::max(widest_, box.size().x());
    std::sort(byX_.begin(), byX_.end());
  }

  PairTally tick(std::span<const Box> movers) {
    reach_.resize(movers.size());
    candidates_.resize(movers.size());
    PairTally tally;
    for (std::uint32_t a = 0; a < movers.size(); ++a) {
      if (!collision::contains(reach_[a], movers[a])) gather(a, collision::grown(movers[a], 1));
      for (const std::uint32_t s : candidates_[a]) {
        if (collision::overlaps(movers[a], still_[s])) tally.addStill(a, s);
      }
      for (std::uint32_t b = a + 1; b < movers.size(); ++b) {
        if (collision::overlaps(movers[a], movers[b])) tally.addMovers(a, b);
      }
    }
    return tally;
  }

 private:
  void gather(std::uint32_t mover, const Box& reach) {
    reach_[mover] = reach;
    candidates_[mover].clear();
    auto at = std::lower_bound(byX_.begin(), byX_.end(),
                               std::pair(reach.min.x() - widest_ - 1, std::uint32_t{0}));
    for (; at != byX_.end() && at->first <= reach.max.x(); ++at) {
      if (collision::overlaps(reach, still_[at->second])) candidates_[mover].push_back(at->second);
    }
  }

  std::span<const Box> still_;
  std::vector<std::pair<double, std::uint32_t>> byX_;
  double widest_ = 0;
  std::vector<Box> reach_;
  std::vector<std::vector<std::uint32_t>> candidates_;
};

/// The truth is itself compared with the slow twin of the library, once a size.
bool truthHolds(const Building& building, std::span<const Box> movers, const PairTally& told) {
  std::vector<std::pair<collision::MoverId, Box>> live;
  for (std::uint32_t id = 0; id < movers.size(); ++id) live.emplace_back(id, movers[id]);
  PairTally expected;
  for (const BoxPair& pair : collision::bruteForcePairs(building.still, live)) {
    if (pair.otherMoves) expected.addMovers(pair.mover, pair.other);
    if (!pair.otherMoves) expected.addStill(pair.mover, pair.other);
  }
  return expected.sameAs(told);
}

/// The boxes of all ticks, and what is to be told about them.
struct Motion {
  std::vector<std::vector<Box>> boxes;
  std::vector<PairTally> pairs;
};

Motion record(const Building& building, std::size_t movers, int ticks) {
  Motion motion;
  BuildingMotion bodies(building, movers);
  PairTruth truth(building.still);
  for (int tick = 0; tick < ticks; ++tick) {
    const auto boxes = bodies.next();
    motion.boxes.emplace_back(boxes.begin(), boxes.end());
    motion.pairs.push_back(truth.tick(boxes));
  }
  const std::size_t work = movers * building.still.size();
  if (work <= 10000000 && !truthHolds(building, motion.boxes[0], motion.pairs[0])) {
    std::fprintf(stderr, "the truth differs from brute force\n");
    std::exit(1);
  }
  return motion;
}

struct Run {
  const BroadPhaseMethod* method = nullptr;
  std::unique_ptr<BroadPhase> phase;
  double buildSeconds = 0, bytesAnObject = 0, spent = 0;
  std::vector<double> microseconds;
  std::size_t tick = 0, wrong = 0;
};

double heapBytes() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

Run build(const BroadPhaseMethod& method, const Building& building) {
  Run run;
  run.method = &method;
  const double before = heapBytes();
  const auto start = Clock::now();
  run.phase = method.make(building.still);
  run.buildSeconds = secondsSince(start);
  const double bytes = heapBytes() - before + static_cast<double>(run.phase->hiddenBytes());
  run.bytesAnObject = bytes / static_cast<double>(building.still.size());
  return run;
}

/// Some ticks of one method. The first of them finds the caches full of other methods' data (and
/// the very first inserts the movers): it is not timed.
void turn(Run& run, const Motion& motion, const Effort& effort) {
  const std::size_t until =
      std::min(motion.boxes.size(), run.tick + motion.boxes.size() / kTurns + 1);
  const std::size_t first = run.tick;
  for (; run.tick < until; ++run.tick) {
    if (run.tick > kLeastTicks && run.spent > effort.secondsAMethod) return;
    PairTally tally;
    const auto start = Clock::now();
    run.phase->tick(motion.boxes[run.tick], tally);
    const double seconds = secondsSince(start);
    run.spent += seconds;
    if (run.tick > first) run.microseconds.push_back(1e6 * seconds);
    if (!tally.sameAs(motion.pairs[run.tick])) ++run.wrong;
  }
}

const char* kindName(BroadPhaseMethod::Kind kind) {
  if (kind == BroadPhaseMethod::Kind::ours) return "ours";
  return kind == BroadPhaseMethod::Kind::approach ? "approach" : "peer";
}

nlohmann::json headOf(const BroadPhaseMethod& method, std::size_t objects, std::size_t movers) {
  return {{"bench", "broad"},
          {"method", method.name},
          {"kind", kindName(method.kind)},
          {"objects", objects},
          {"movers", movers}};
}

void print(const Run& run, std::size_t objects, std::size_t movers, double pairs,
           Results& results) {
  const double median = quantile(run.microseconds, 0.5);
  const double p99 = quantile(run.microseconds, 0.99);
  std::printf(
      "%-22s %8zu %6zu | %10.2f %10.2f %8.3f us a mover | build %7.3f s %6.0f B an object"
      " | %5zu of %4zu ticks wrong\n",
      run.method->name.c_str(), objects, movers, median, p99, median / static_cast<double>(movers),
      run.buildSeconds, run.bytesAnObject, run.wrong, run.tick);
  std::fflush(stdout);
  auto line = headOf(*run.method, objects, movers);
  line.update({{"median_us", median},
               {"p99_us", p99},
               {"build_s", run.buildSeconds},
               {"bytes", run.bytesAnObject},
               {"ticks", run.tick},
               {"wrong", run.wrong},
               {"pairs", pairs}});
  results.add(line);
}

void leaveOut(const BroadPhaseMethod& method, std::size_t objects, std::size_t movers,
              Results& results) {
  std::printf("%-22s %8zu %6zu | left out: %s\n", method.name.c_str(), objects, movers,
              method.reason.c_str());
  auto line = headOf(method, objects, movers);
  line.update({{"left_out", method.reason}});
  results.add(line);
}

std::size_t measure(const Building& building, std::size_t objects, std::size_t movers,
                    const Effort& effort, const Arguments& arguments,
                    const std::vector<BroadPhaseMethod>& methods, Results& results) {
  const Motion motion = record(building, movers, effort.ticks);
  std::vector<Run> runs;
  for (const BroadPhaseMethod& method : methods) {
    if (!arguments.wants(method.name)) continue;
    if (objects > method.mostObjects / effort.slowShare) {
      leaveOut(method, objects, movers, results);
    } else {
      runs.push_back(build(method, building));
    }
  }
  for (int k = 0; k < kTurns; ++k) {
    for (Run& run : runs) turn(run, motion, effort);
  }
  std::size_t wrong = 0;
  for (const Run& run : runs) {
    print(run, objects, movers, static_cast<double>(motion.pairs.back().count), results);
    if (run.method->kind != BroadPhaseMethod::Kind::peer) wrong += run.wrong;
  }
  return wrong;
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments(argc, argv);
  const Effort effort =
      arguments.quick ? Effort{100000, 121, 0.1, 10} : Effort{1000000, 601, 1.5, 1};
  Results results(arguments);
  const auto methods = broadPhaseMethods();
  std::size_t wrong = 0;
  for (std::size_t objects = 1000; objects <= effort.mostObjects; objects *= 10) {
    const Building building = makeBuilding(objects);
    for (const std::size_t movers : {10u, 100u, 1000u}) {
      wrong += measure(building, objects, movers, effort, arguments, methods, results);
    }
  }
  return wrong == 0 ? 0 : 3;
}
