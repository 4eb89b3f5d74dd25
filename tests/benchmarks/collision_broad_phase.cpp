// Benchmark of all broad phases on one motion: ours, other approaches of Lin (1993), peers.
//
//   collision_broad_phase [--quick] [--out FILE] [--only PART_OF_A_NAME]
//   collision_broad_phase --ours OBJECTS MOVERS [TICKS]
//      ours alone, unchecked: for callgrind, with valgrind --tool=callgrind --collect-atstart=no
//      --toggle-collect='*oursTick*'
//
// The workload is that of building_workload.hpp. Methods run in turns of some dozens of ticks on
// the same boxes, so that a disturbance of the machine affects all of them. A tick is timed from
// the new boxes to all reported pairs. Number and sum of mixed ids of its pairs are checked against
// an independent method (PairTruth) every tick. A method stops when its time for a size is used up.
//
// The motion is run kRuns times with newly built methods. A tick counts with its minimum time, as
// all runs do the same work and a busy machine only adds time. Methods with a long build time run
// once.
//
// Bytes are the method's heap without the static boxes themselves, before movers are added: 48
// bytes a box are subtracted if the method copied them.

#include <malloc.h>

#include <cstdlib>
#include <cstring>

#include "collision/broad_phase/broad_phase_audit.hpp"
#include "tests/benchmarks/broad_phase_method.hpp"
#include "tests/benchmarks/building_workload.hpp"
#include "tests/benchmarks/measurement.hpp"

namespace {

using namespace enfilade::benchmarks;
namespace collision = enfilade::collision;

constexpr int kTurns = 6;
constexpr int kRuns = 3;
constexpr double kLongToBuild = 0.5;  // seconds

struct Effort {
  std::size_t mostObjects;
  int ticks;
  double secondsAMethod;  ///< for ticks, per size; at least kMinTicks are always made
  std::size_t slowShare;  ///< methods with an object limit are skipped above limit / slowShare
};
constexpr int kMinTicks = 4;

/// Reference for the pairs of a tick: for each mover all static boxes within a metre of its
/// position at the last gathering. Gathering scans a list sorted on x.
class PairTruth {
 public:
  explicit PairTruth(std::span<const Aabb> still) : still_(still) {
    for (std::uint32_t s = 0; s < still.size(); ++s) byX_.emplace_back(still[s].min.x(), s);
    for (const Aabb& box : still) widest_ = std::max(widest_, box.size().x());
    std::sort(byX_.begin(), byX_.end());
  }

  PairTally tick(std::span<const Aabb> movers) {
    reach_.resize(movers.size());
    candidates_.resize(movers.size());
    PairTally tally;
    for (std::uint32_t a = 0; a < movers.size(); ++a) {
      if (!collision::contains(reach_[a], movers[a])) gather(a, collision::inflated(movers[a], 1));
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
  void gather(std::uint32_t mover, const Aabb& reach) {
    reach_[mover] = reach;
    candidates_[mover].clear();
    auto at = std::lower_bound(byX_.begin(), byX_.end(),
                               std::pair(reach.min.x() - widest_ - 1, std::uint32_t{0}));
    for (; at != byX_.end() && at->first <= reach.max.x(); ++at) {
      if (collision::overlaps(reach, still_[at->second])) candidates_[mover].push_back(at->second);
    }
  }

  std::span<const Aabb> still_;
  std::vector<std::pair<double, std::uint32_t>> byX_;
  double widest_ = 0;
  std::vector<Aabb> reach_;
  std::vector<std::vector<std::uint32_t>> candidates_;
};

/// The reference itself is compared with the library's brute force, once a size.
bool truthHolds(const Building& building, std::span<const Aabb> movers, const PairTally& reported) {
  std::vector<std::pair<collision::ProxyId, Aabb>> live;
  for (std::uint32_t id = 0; id < movers.size(); ++id) live.emplace_back(id, movers[id]);
  PairTally expected;
  for (const ProxyPair& pair : collision::findPairsBruteForce(building.still, live)) {
    if (pair.otherIsDynamic) expected.addMovers(pair.proxy, pair.other);
    if (!pair.otherIsDynamic) expected.addStill(pair.proxy, pair.other);
  }
  return expected.sameAs(reported);
}

/// The boxes of all ticks, and their expected pairs.
struct Motion {
  std::vector<std::vector<Aabb>> boxes;
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
    std::fprintf(stderr, "the reference differs from brute force\n");
    std::exit(1);
  }
  return motion;
}

struct Run {
  const BroadPhaseMethod* method = nullptr;
  std::unique_ptr<BroadPhase> phase;
  double buildSeconds = 0, bytesAnObject = 0, spent = 0;
  std::vector<double> microseconds;  ///< by tick; 0 if not timed
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
  if (!run.phase->readsGivenBoxes()) run.bytesAnObject -= sizeof(Aabb);
  return run;
}

/// Runs some ticks of one method. The first tick finds the caches full of other methods' data (and
/// the very first inserts the movers), so it is not timed.
void turn(Run& run, const Motion& motion, const Effort& effort) {
  const std::size_t until =
      std::min(motion.boxes.size(), run.tick + motion.boxes.size() / kTurns + 1);
  const std::size_t first = run.tick;
  for (; run.tick < until; ++run.tick) {
    if (run.tick > kMinTicks && run.spent > effort.secondsAMethod) return;
    PairTally tally;
    const auto start = Clock::now();
    run.phase->tick(motion.boxes[run.tick], tally);
    const double seconds = secondsSince(start);
    run.spent += seconds;
    run.microseconds.push_back(run.tick > first ? 1e6 * seconds : 0);
    if (!tally.sameAs(motion.pairs[run.tick])) ++run.wrong;
  }
}

/// Takes the minimum of two runs of a method, tick by tick.
void takeLeast(Run& best, const Run& again) {
  best.buildSeconds = std::min(best.buildSeconds, again.buildSeconds);
  best.wrong = std::max(best.wrong, again.wrong);
  const std::size_t both = std::min(best.microseconds.size(), again.microseconds.size());
  for (std::size_t k = 0; k < both; ++k) {
    best.microseconds[k] = std::min(best.microseconds[k], again.microseconds[k]);
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
  std::vector<double> timed = run.microseconds;
  std::erase(timed, 0.0);
  const double median = quantile(timed, 0.5);
  const double p99 = quantile(timed, 0.99);
  std::printf(
      "%-22s %8zu %6zu | %10.2f %10.2f %8.3f us a mover | build %7.3f s %6.1f B an object"
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

void runAll(std::vector<Run>& runs, const Motion& motion, const Effort& effort) {
  for (int k = 0; k < kTurns; ++k) {
    for (Run& run : runs) turn(run, motion, effort);
  }
  for (Run& run : runs) run.phase.reset();
}

std::size_t measure(const Building& building, std::size_t objects, std::size_t movers,
                    const Effort& effort, const Arguments& arguments,
                    const std::vector<BroadPhaseMethod>& methods, Results& results) {
  const Motion motion = record(building, movers, effort.ticks);
  std::vector<Run> best;
  for (const BroadPhaseMethod& method : methods) {
    if (!arguments.wants(method.name)) continue;
    if (objects > method.mostObjects / effort.slowShare) {
      leaveOut(method, objects, movers, results);
    } else {
      best.push_back(build(method, building));
    }
  }
  runAll(best, motion, effort);
  for (int k = 1; k < kRuns; ++k) {
    std::vector<Run> again;
    for (const Run& run : best) {
      if (run.buildSeconds < kLongToBuild) again.push_back(build(*run.method, building));
    }
    runAll(again, motion, effort);
    for (const Run& run : again) {
      takeLeast(*std::find_if(best.begin(), best.end(),
                              [&](const Run& b) { return b.method == run.method; }),
                run);
    }
  }
  std::size_t wrong = 0;
  for (const Run& run : best) {
    print(run, objects, movers, static_cast<double>(motion.pairs.back().count), results);
    if (run.method->kind != BroadPhaseMethod::Kind::peer) wrong += run.wrong;
  }
  return wrong;
}

// ---- ours alone --------------------------------------------------------------------------------

[[gnu::noinline]] std::size_t oursTick(collision::SortAndSweep& sweep,
                                       std::span<const Aabb> boxes) {
  for (collision::ProxyId id = 0; id < boxes.size(); ++id) sweep.move(id, boxes[id]);
  sweep.update();
  std::size_t ends = 0;
  for (collision::ProxyId id = 0; id < boxes.size(); ++id) ends += sweep.overlapsOf(id).size();
  return ends;
}

void oursAlone(std::size_t objects, std::size_t movers, std::size_t ticks) {
  const Building building = makeBuilding(objects);
  collision::SortAndSweep sweep(building.still);
  BuildingMotion motion(building, movers);
  for (const Aabb& box : motion.next()) sweep.insert(box);
  sweep.update();
  std::size_t ends = 0, exchanges = 0, boxTests = 0, laid = 0;
  std::vector<double> microseconds;
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const auto boxes = motion.next();
    const auto start = Clock::now();
    ends += oursTick(sweep, boxes);
    microseconds.push_back(1e6 * secondsSince(start));
    exchanges += sweep.counters().swaps;
    boxTests += sweep.counters().aabbTests;
    laid += sweep.counters().windowsBuilt;
  }
  const double share = 1 / static_cast<double>(movers * ticks);
  std::printf("%zu objects, %zu movers, %zu ticks: median %.2f us, p99 %.2f us\n",
              building.still.size(), movers, ticks, quantile(microseconds, 0.5),
              quantile(microseconds, 0.99));
  std::printf("a mover and tick: %.2f pairs, %.3f swaps, %.3f box tests, %.4f windows built\n",
              static_cast<double>(ends) * share, static_cast<double>(exchanges) * share,
              static_cast<double>(boxTests) * share, static_cast<double>(laid) * share);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 3 && std::strcmp(argv[1], "--ours") == 0) {
    const auto number = [&](int at) { return std::strtoul(argv[at], nullptr, 10); };
    oursAlone(number(2), number(3), argc > 4 ? number(4) : 600);
    return 0;
  }
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
