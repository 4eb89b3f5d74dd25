// Benchmark of all broad phases on one motion: ours, other approaches of Lin (1993), peers.
//
//   collision_broad_phase [--quick] [--out FILE] [--only PART_OF_A_NAME]
//   collision_broad_phase --ours OBJECTS DYNAMIC [TICKS]
//      ours alone, unchecked: for callgrind, with valgrind --tool=callgrind --collect-atstart=no
//      --toggle-collect='*tickOurs*'
//
// The workload is that of building_workload.hpp, the way of measuring that of broad_phase_runs.hpp.
// The pairs of every tick are checked against an independent method (PairTruth).

#include <cstdlib>
#include <cstring>

#include "collision/broad_phase/broad_phase_audit.hpp"
#include "tests/benchmarks/broad_phase_method.hpp"
#include "tests/benchmarks/broad_phase_runs.hpp"
#include "tests/benchmarks/building_workload.hpp"
#include "tests/benchmarks/measurement.hpp"

namespace {

using namespace enfilade::benchmarks;
namespace collision = enfilade::collision;

struct Effort {
  std::size_t maxObjects;
  int ticks;
  double secondsAMethod;  ///< for ticks, per size
  std::size_t slowShare;  ///< methods with an object limit are skipped above limit / slowShare
};

/// Reference for the pairs of a tick: for each dynamic box all static boxes within a metre of its
/// position at the last gathering. Gathering scans a list sorted on x.
class PairTruth {
 public:
  explicit PairTruth(std::span<const Aabb> staticBoxes) : staticBoxes_(staticBoxes) {
    for (std::uint32_t s = 0; s < staticBoxes.size(); ++s)
      byX_.emplace_back(staticBoxes[s].min.x(), s);
    for (const Aabb& box : staticBoxes) widest_ = std::max(widest_, box.size().x());
    std::sort(byX_.begin(), byX_.end());
  }

  PairTally runTick(std::span<const Aabb> dynamicBoxes) {
    reach_.resize(dynamicBoxes.size());
    candidates_.resize(dynamicBoxes.size());
    PairTally tally;
    for (std::uint32_t a = 0; a < dynamicBoxes.size(); ++a) {
      if (!collision::contains(reach_[a], dynamicBoxes[a]))
        gather(a, collision::inflate(dynamicBoxes[a], 1));
      for (const std::uint32_t s : candidates_[a]) {
        if (collision::overlaps(dynamicBoxes[a], staticBoxes_[s])) tally.addStaticPair(a, s);
      }
      for (std::uint32_t b = a + 1; b < dynamicBoxes.size(); ++b) {
        if (collision::overlaps(dynamicBoxes[a], dynamicBoxes[b])) tally.addDynamicPair(a, b);
      }
    }
    return tally;
  }

 private:
  void gather(std::uint32_t dynamicBox, const Aabb& reach) {
    reach_[dynamicBox] = reach;
    candidates_[dynamicBox].clear();
    auto at = std::lower_bound(byX_.begin(), byX_.end(),
                               std::pair(reach.min.x() - widest_ - 1, std::uint32_t{0}));
    for (; at != byX_.end() && at->first <= reach.max.x(); ++at) {
      if (collision::overlaps(reach, staticBoxes_[at->second]))
        candidates_[dynamicBox].push_back(at->second);
    }
  }

  std::span<const Aabb> staticBoxes_;
  std::vector<std::pair<double, std::uint32_t>> byX_;
  double widest_ = 0;
  std::vector<Aabb> reach_;
  std::vector<std::vector<std::uint32_t>> candidates_;
};

/// The reference itself is compared with the library's brute force, once a size.
bool checkTruth(const Building& building, std::span<const Aabb> dynamicBoxes,
                const PairTally& reported) {
  std::vector<std::pair<collision::ProxyId, Aabb>> live;
  for (std::uint32_t id = 0; id < dynamicBoxes.size(); ++id)
    live.emplace_back(id, dynamicBoxes[id]);
  PairTally expected;
  for (const ProxyPair& pair : collision::findPairsBruteForce(building.staticBoxes, live)) {
    if (pair.otherIsDynamic) expected.addDynamicPair(pair.proxy, pair.other);
    if (!pair.otherIsDynamic) expected.addStaticPair(pair.proxy, pair.other);
  }
  return expected.isSameAs(reported);
}

RecordedBoxes record(const Building& building, std::size_t dynamicBoxes, int ticks) {
  RecordedBoxes motion;
  BuildingMotion bodies(building, dynamicBoxes);
  PairTruth truth(building.staticBoxes);
  for (int tick = 0; tick < ticks; ++tick) {
    const auto boxes = bodies.next();
    motion.boxes.emplace_back(boxes.begin(), boxes.end());
    motion.pairs.push_back(truth.runTick(boxes));
  }
  const std::size_t work = dynamicBoxes * building.staticBoxes.size();
  if (work <= 10000000 && !checkTruth(building, motion.boxes[0], motion.pairs[0])) {
    std::fprintf(stderr, "the reference differs from brute force\n");
    std::exit(1);
  }
  return motion;
}

nlohmann::json makeHead(const BroadPhaseMethod& method, std::size_t objects,
                        std::size_t dynamicBoxes) {
  return {{"bench", "broad"},
          {"method", method.name},
          {"kind", getKindName(method.kind)},
          {"objects", objects},
          {"dynamic_boxes", dynamicBoxes}};
}

void print(const BroadPhaseRun& run, std::size_t objects, std::size_t dynamicBoxes, double pairs,
           Results& results) {
  std::vector<double> timed = run.microseconds;
  std::erase(timed, 0.0);
  const double median = computeQuantile(timed, 0.5);
  const double p99 = computeQuantile(timed, 0.99);
  std::printf(
      "%-22s %8zu %6zu | %10.2f %10.2f %8.3f us a dynamic box | build %7.3f s %6.1f B an object"
      " | %5zu of %4zu ticks wrong\n",
      run.method->name.c_str(), objects, dynamicBoxes, median, p99,
      median / static_cast<double>(dynamicBoxes), run.buildSeconds, run.bytesAnObject, run.wrong,
      run.tick);
  std::fflush(stdout);
  auto line = makeHead(*run.method, objects, dynamicBoxes);
  line.update({{"median_us", median},
               {"p99_us", p99},
               {"build_s", run.buildSeconds},
               {"bytes", run.bytesAnObject},
               {"ticks", run.tick},
               {"wrong", run.wrong},
               {"pairs", pairs}});
  results.add(line);
}

void leaveOut(const BroadPhaseMethod& method, std::size_t objects, std::size_t dynamicBoxes,
              Results& results) {
  std::printf("%-22s %8zu %6zu | left out: %s\n", method.name.c_str(), objects, dynamicBoxes,
              method.reason.c_str());
  auto line = makeHead(method, objects, dynamicBoxes);
  line.update({{"left_out", method.reason}});
  results.add(line);
}

std::size_t measure(const Building& building, std::size_t objects, std::size_t dynamicBoxes,
                    const Effort& effort, const Arguments& arguments,
                    const std::vector<BroadPhaseMethod>& methods, Results& results) {
  const RecordedBoxes motion = record(building, dynamicBoxes, effort.ticks);
  std::vector<const BroadPhaseMethod*> chosen;
  for (const BroadPhaseMethod& method : methods) {
    if (!arguments.wants(method.name)) continue;
    if (objects > method.maxObjects / effort.slowShare) {
      leaveOut(method, objects, dynamicBoxes, results);
    } else {
      chosen.push_back(&method);
    }
  }
  const std::vector<BroadPhaseRun> best =
      runMethods(chosen, building.staticBoxes, motion, effort.secondsAMethod);
  std::size_t wrong = 0;
  for (const BroadPhaseRun& run : best) {
    print(run, objects, dynamicBoxes, static_cast<double>(motion.pairs.back().count), results);
    if (run.method->kind != BroadPhaseMethod::Kind::peer) wrong += run.wrong;
  }
  return wrong;
}

// ---- ours alone --------------------------------------------------------------------------------

[[gnu::noinline]] std::size_t tickOurs(collision::SortAndSweep& sweep,
                                       std::span<const Aabb> boxes) {
  for (collision::ProxyId id = 0; id < boxes.size(); ++id) sweep.move(id, boxes[id]);
  sweep.update();
  std::size_t ends = 0;
  for (collision::ProxyId id = 0; id < boxes.size(); ++id) ends += sweep.getOverlaps(id).size();
  return ends;
}

void runOursAlone(std::size_t objects, std::size_t dynamicBoxes, std::size_t ticks) {
  const Building building = makeBuilding(objects);
  collision::SortAndSweep sweep(building.staticBoxes);
  BuildingMotion motion(building, dynamicBoxes);
  for (const Aabb& box : motion.next()) sweep.insert(box);
  sweep.update();
  std::size_t ends = 0, exchanges = 0, aabbTests = 0, laid = 0;
  std::vector<double> microseconds;
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const auto boxes = motion.next();
    const auto start = Clock::now();
    ends += tickOurs(sweep, boxes);
    microseconds.push_back(1e6 * measureSecondsSince(start));
    exchanges += sweep.counters().swaps;
    aabbTests += sweep.counters().aabbTests;
    laid += sweep.counters().windowsBuilt;
  }
  const double share = 1 / static_cast<double>(dynamicBoxes * ticks);
  std::printf("%zu objects, %zu dynamic boxes, %zu ticks: median %.2f us, p99 %.2f us\n",
              building.staticBoxes.size(), dynamicBoxes, ticks, computeQuantile(microseconds, 0.5),
              computeQuantile(microseconds, 0.99));
  std::printf(
      "a dynamic box and tick: %.2f pairs, %.3f swaps, %.3f box tests, %.4f windows built\n",
      static_cast<double>(ends) * share, static_cast<double>(exchanges) * share,
      static_cast<double>(aabbTests) * share, static_cast<double>(laid) * share);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 3 && std::strcmp(argv[1], "--ours") == 0) {
    const auto number = [&](int at) { return std::strtoul(argv[at], nullptr, 10); };
    runOursAlone(number(2), number(3), argc > 4 ? number(4) : 600);
    return 0;
  }
  const Arguments arguments(argc, argv);
  const Effort effort =
      arguments.quick ? Effort{100000, 121, 0.1, 10} : Effort{1000000, 601, 1.5, 1};
  Results results(arguments);
  const auto methods = makeBroadPhaseMethods();
  std::size_t wrong = 0;
  for (std::size_t objects = 1000; objects <= effort.maxObjects; objects *= 10) {
    const Building building = makeBuilding(objects);
    for (const std::size_t dynamicBoxes : {10u, 100u, 1000u}) {
      wrong += measure(building, objects, dynamicBoxes, effort, arguments, methods, results);
    }
  }
  return wrong == 0 ? 0 : 3;
}
