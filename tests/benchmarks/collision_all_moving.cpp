// Benchmark of all broad phases where everything moves (moving_cubes.hpp): ours and the peers.
//
//   collision_all_moving [--quick] [--out FILE] [--only PART_OF_A_NAME]
//
// The way of measuring is that of broad_phase_runs.hpp. The expected pairs are those of a sweep of
// the whole list along x, which shares no code with ours.

#include "tests/benchmarks/approaches/dynamic_sweep.hpp"
#include "tests/benchmarks/broad_phase_method.hpp"
#include "tests/benchmarks/broad_phase_runs.hpp"
#include "tests/benchmarks/measurement.hpp"
#include "tests/benchmarks/moving_cubes.hpp"

namespace {

using namespace enfilade::benchmarks;

struct Size {
  std::size_t cubes;
  int ticks;
  double secondsAMethod;
};
constexpr Size kSizes[] = {{1000, 301, 1}, {8000, 121, 3}, {64000, 61, 12}};
constexpr Size kQuickSizes[] = {{1000, 121, 0.3}, {8000, 31, 0.6}};

/// Records `ticks` frames of several sources of boxes together.
template <typename... Source>
RecordedBoxes record(int ticks, Source... sources) {
  DynamicSweep truth;
  RecordedBoxes recorded;
  for (int tick = 0; tick < ticks; ++tick) {
    std::vector<Aabb>& all = recorded.boxes.emplace_back();
    const auto append = [&](std::span<const Aabb> boxes) {
      all.insert(all.end(), boxes.begin(), boxes.end());
    };
    (append(sources.next()), ...);
    truth.reportPairs(all, recorded.pairs.emplace_back());
  }
  return recorded;
}

/// Two distant boxes, which some peers need to know the extent of the world.
std::vector<Aabb> makeDistantBoxes() {
  return {{Vec3(-1e3, -1001, -1e3), Vec3(1e3, -1000, 1e3)},
          {Vec3(-1e3, 1000, -1e3), Vec3(1e3, 1001, 1e3)}};
}

std::vector<double> selectTimed(const BroadPhaseRun& run) {
  std::vector<double> timed = run.microseconds;
  std::erase(timed, 0.0);
  return timed;
}

std::size_t measure(CubeMotion motion, const Size& size, const Arguments& arguments,
                    const std::vector<BroadPhaseMethod>& methods, Results& results) {
  const RecordedBoxes recorded = record(size.ticks, MovingCubes(motion, size.cubes));
  const std::vector<Aabb> distant = makeDistantBoxes();
  std::vector<const BroadPhaseMethod*> chosen;
  for (const BroadPhaseMethod& method : methods) {
    if (method.kind != BroadPhaseMethod::Kind::approach && arguments.wants(method.name) &&
        size.cubes <= method.maxDynamicBoxes)
      chosen.push_back(&method);
  }
  std::size_t wrong = 0;
  for (const BroadPhaseRun& run : runMethods(chosen, distant, recorded, size.secondsAMethod)) {
    const std::vector<double> timed = selectTimed(run);
    const double median = computeQuantile(timed, 0.5) / 1e3,
                 p99 = computeQuantile(timed, 0.99) / 1e3;
    const double pairs = static_cast<double>(recorded.pairs.back().count);
    std::printf("%-22s %-9s %6zu cubes | %9.3f ms (99 %% %9.3f, first %9.2f) | %zu of %zu wrong\n",
                run.method->name.c_str(), getName(motion), size.cubes, median, p99,
                1e3 * run.firstTick, run.wrong, run.tick);
    std::fflush(stdout);
    results.add({{"bench", "moving"},
                 {"method", run.method->name},
                 {"kind", getKindName(run.method->kind)},
                 {"motion", getName(motion)},
                 {"cubes", size.cubes},
                 {"median_ms", median},
                 {"p99_ms", p99},
                 {"first_ms", 1e3 * run.firstTick},
                 {"ticks", run.tick},
                 {"wrong", run.wrong},
                 {"pairs", pairs}});
    if (run.method->kind == BroadPhaseMethod::Kind::ours) wrong += run.wrong;
  }
  return wrong;
}

/// A heap whose endpoint lists would be expensive, and walkers elsewhere whose lists are cheap. The
/// cost of both in one sweep against one sweep for each. Returns the number of wrong frames.
std::size_t measureHeapBesideWalkers(const Size& size, const BroadPhaseMethod& ours,
                                     Results& results) {
  constexpr std::size_t kWalkers = 1000;
  const MovingCubes heap(CubeMotion::turbulent, size.cubes);
  const WalkingBoxes walkers(kWalkers, Vec3(500, 0, 0));
  const std::vector<Aabb> distant = makeDistantBoxes();
  const BroadPhaseMethod* const methods[] = {&ours};
  std::size_t wrong = 0;
  const auto measureMedian = [&](const RecordedBoxes& recorded) {
    const auto runs = runMethods(methods, distant, recorded, size.secondsAMethod);
    wrong += runs[0].wrong;
    return computeQuantile(selectTimed(runs[0]), 0.5) / 1e3;
  };
  const double ofHeap = measureMedian(record(size.ticks, heap));
  const double ofWalkers = measureMedian(record(size.ticks, walkers));
  const double ofBoth = measureMedian(record(size.ticks, heap, walkers));
  std::printf("%zu turbulent cubes %.3f ms, %zu walkers %.3f ms, in one sweep %.3f ms\n",
              size.cubes, ofHeap, kWalkers, ofWalkers, ofBoth);
  results.add({{"bench", "regions"},
               {"cubes", size.cubes},
               {"walkers", kWalkers},
               {"heap_ms", ofHeap},
               {"walkers_ms", ofWalkers},
               {"both_ms", ofBoth},
               {"wrong", wrong}});
  return wrong;
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments(argc, argv);
  Results results(arguments);
  const auto methods = makeBroadPhaseMethods();
  const std::span<const Size> sizes =
      arguments.quick ? std::span<const Size>(kQuickSizes) : std::span<const Size>(kSizes);
  std::size_t wrong = 0;
  for (const Size& size : sizes) {
    for (const CubeMotion motion : kCubeMotions)
      wrong += measure(motion, size, arguments, methods, results);
  }
  for (const BroadPhaseMethod& method : methods) {
    if (method.kind == BroadPhaseMethod::Kind::ours)
      wrong += measureHeapBesideWalkers(sizes[1], method, results);
  }
  return wrong == 0 ? 0 : 3;
}
