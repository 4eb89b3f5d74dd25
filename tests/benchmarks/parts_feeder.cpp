// Benchmark of the parts feeder (Lin 1993, section 5.4): a vibrating tray with small convex parts.
// Ours with one and two threads; peers with their default settings and one thread. Prints speed
// against penetration, measured for all by the exact narrow phase, and the checks of ours; exits
// with 1 if one of ours fails.
//
//   parts_feeder [PARTS [TICKS [ours | ode]]]
//      default 1000 parts and 240 ticks; 10000 for the full run, of which one thread and the peers
//      run the first 240; `ours`: without peers; `ode`: without Bullet
//
// The last tenth of the ticks, after settling, is also printed separately. `scene`: the bundled
// scene in its world with contact events, as in the server; measured by the tick reports.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string_view>

#include "assets/feeder.hpp"
#include "scene/import/bodies/sidecar.hpp"
#include "scene/world/world.hpp"
#include "tests/benchmarks/feeder_engine.hpp"

namespace enfilade::benchmarks {
namespace {

using testing::FeederCheck;
using testing::FeederFindings;
using testing::FeederPlan;

constexpr int kJudgeEvery = 20;          // ticks
constexpr int kThreads = 2;              // of our engine
constexpr int kMaxTicksToSleep = 600;    // 10 s
constexpr int kMaxTicksOneThread = 240;  // ticks of ours with one thread, and of the peers

class OurFeeder : public FeederEngine {
 public:
  OurFeeder(const FeederPlan& plan, int threads) : feeder_(plan, threads) {}
  void runTick(bool driven) override { feeder_.tick(driven); }
  std::vector<testing::PlacedPart> getParts() const override { return feeder_.getParts(); }
  testing::Vec3 getTray() const override { return feeder_.getTrayPosition(); }
  double computeEnergy() const { return feeder_.computeEnergy(); }
  const scene::StepReport& getReport() const { return feeder_.getReport(); }
  double getEpsilon() { return feeder_.getSettings().solver.contactOffset; }

 private:
  testing::Feeder feeder_;
};

struct Row {
  double seconds = 0;  ///< of the ticks
  double cpu = 0;      ///< of the ticks, all threads together
  FeederFindings worst;
};

FeederFindings mergeWorst(const FeederFindings& a, const FeederFindings& b) {
  return {std::max(a.deepest, b.deepest), std::max(a.penetrating, b.penetrating),
          std::max(a.outside, b.outside)};
}

double readProcessSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Row run(FeederEngine& engine, const FeederCheck& feederCheck, int ticks, bool driven,
        const std::function<void()>& afterTick = {}) {
  Row row;
  for (int i = 1; i <= ticks; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const double cpu = readProcessSeconds();
    engine.runTick(driven);
    row.cpu += readProcessSeconds() - cpu;
    row.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (afterTick) afterTick();
    if (i % kJudgeEvery != 0) continue;
    row.worst = mergeWorst(row.worst, feederCheck.evaluate(engine.getParts(), engine.getTray()));
  }
  return row;
}

/// Concatenates two measured intervals.
Row joinRows(const Row& first, const Row& second) {
  return {first.seconds + second.seconds, first.cpu + second.cpu,
          mergeWorst(first.worst, second.worst)};
}

void print(const char* name, const Row& row, int ticks) {
  std::printf("%-16s %10.2f %10.2f %10.2f %14.4f %12zu %9zu\n", name, 1e3 * row.seconds / ticks,
              1e3 * row.cpu / ticks, ticks / 60.0 / row.seconds, 1e3 * row.worst.deepest,
              row.worst.penetrating, row.worst.outside);
}

bool check(bool holds, const char* what) {
  std::printf("  %s  %s\n", holds ? "holds " : "BROKEN", what);
  return holds;
}

bool checkOurs(const FeederPlan& plan, const FeederCheck& feederCheck, int ticks) {
  OurFeeder still(plan, kThreads);
  const double start = still.computeEnergy();
  double maxEnergy = start;
  const auto watchEnergy = [&] { maxEnergy = std::max(maxEnergy, still.computeEnergy()); };
  Row off = run(still, feederCheck, ticks, false, watchEnergy);
  int asleepAfter = ticks;  // the run continues untimed until the whole heap sleeps
  for (; asleepAfter < kMaxTicksToSleep && still.getReport().awake > 0; asleepAfter += kJudgeEvery)
    off.worst =
        mergeWorst(off.worst, run(still, feederCheck, kJudgeEvery, false, watchEnergy).worst);
  OurFeeder driven(plan, kThreads), alone(plan, 1);
  std::uint64_t shortened = 0, crushed = 0, solids = 0;
  const auto count = [&] {
    shortened += driven.getReport().reducedMotions;
    crushed += driven.getReport().crushed;
    solids += plan.parts.size() * static_cast<std::uint64_t>(plan.looks);
  };
  const int last = std::max(kJudgeEvery, ticks / 10);
  const Row begun = run(driven, feederCheck, ticks - last, true, count);
  const Row ended = run(driven, feederCheck, last, true, count);
  const Row on = joinRows(begun, ended);
  const Row one = run(alone, feederCheck, std::min(ticks, kMaxTicksOneThread), true);
  print("ours, drive off", off, ticks);
  print("ours", on, ticks);
  print("ours, last tenth", ended, last);
  print("ours, one thread", one, std::min(ticks, kMaxTicksOneThread));
  std::printf(
      "  energy with the drive off: at most %.6f of its start; reduced: %.2f %%"
      " of all motions, %llu crushed pairs\n",
      maxEnergy / start, 100.0 * static_cast<double>(shortened) / static_cast<double>(solids),
      static_cast<unsigned long long>(crushed));
  std::printf("  with the drive off the heap sleeps after %.1f s at most\n", asleepAfter / 60.0);
  bool all = check(still.getReport().awake == 0, "drive off: the whole heap sleeps within 10 s");
  all &= check(maxEnergy <= 1.001 * start, "drive off: energy never above its start + 0.1 %");
  all &= check(off.worst.outside + on.worst.outside == 0, "all parts inside");
  all &= check(std::max(off.worst.deepest, on.worst.deepest) <= driven.getEpsilon(),
               "penetration <= epsilon");
  return all;
}

/// Whether no part left the tray and none penetrated by more than the contact offset.
bool checkScene(const FeederPlan& plan, int ticks) {
  scene::Model model = assets::makeFeeder({plan.parts.size(), 1});
  scene::applySidecar(model, assets::makeFeederSidecar(), "feeder.walk.json");
  scene::World world(std::make_shared<const scene::Scene>(std::move(model)));
  scene::setThreadCount(world, kThreads);
  const auto isInside = [&](const scene::BodySnapshot& body) {
    const testing::Vec3& at = body.pose.translation;
    return std::abs(at.x()) < plan.inner && std::abs(at.z()) < plan.inner && at.y() > 0.8;
  };
  const auto go = [&](int tickCount) {
    Row row;
    for (int i = 0; i < tickCount; ++i) {
      const double cpu = readProcessSeconds();
      const auto start = std::chrono::steady_clock::now();
      const scene::TickReport report = tickWorld(world);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      row.seconds += took.count(), row.cpu += readProcessSeconds() - cpu;
      FeederFindings now{report.maxPenetration, report.crushedBodies, 0};
      for (const scene::BodySnapshot& body : *report.snapshot->bodies)
        if (!isInside(body)) ++now.outside;
      row.worst = mergeWorst(row.worst, now);
    }
    return row;
  };
  const int last = std::max(kJudgeEvery, ticks / 10);
  const Row begun = go(ticks - last), ended = go(last), all = joinRows(begun, ended);
  print("scene", all, ticks);
  print("  last tenth", ended, last);
  const bool inside = check(all.worst.outside == 0, "all parts of the scene inside");
  return check(all.worst.deepest <= world.settings().contactOffset, "penetration <= epsilon") &&
         inside;
}

int main(int count, char** words) {
  const std::size_t parts = count > 1 ? std::strtoul(words[1], nullptr, 10) : 1000;
  const int ticks = count > 2 ? std::atoi(words[2]) : 240;
  const std::string_view engines = count > 3 ? words[3] : "all";
  if (parts < 1 || parts > 100'000 || ticks < 2 * kJudgeEvery ||
      (engines != "all" && engines != "ours" && engines != "ode")) {
    std::fprintf(stderr, "parts_feeder [PARTS 1..100000 [TICKS, at least %d [ours | ode]]]\n",
                 2 * kJudgeEvery);
    return 2;
  }
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // the peers take minutes
  const FeederPlan plan = testing::planFeeder(parts, 1);
  const FeederCheck feederCheck(plan);
  std::printf("%zu parts, %d ticks of 1/60 s in %d substeps, drive %g Hz, checked every %d ticks\n",
              parts, ticks, plan.substeps, plan.frequency, kJudgeEvery);
  std::printf("%-16s %10s %10s %10s %14s %12s %9s\n", "", "ms a tick", "cpu ms", "real time",
              "deepest mm", "penetrating", "outside");
  bool good = checkOurs(plan, feederCheck, ticks);
  good &= checkScene(plan, ticks);
  [[maybe_unused]] const int few = std::min(ticks, kMaxTicksOneThread);
#ifdef BENCH_BULLET
  if (engines == "all") print("Bullet", run(*makeBulletFeeder(plan), feederCheck, few, true), few);
#endif
#ifdef BENCH_ODE
  if (engines != "ours") print("ODE", run(*makeOdeFeeder(plan), feederCheck, few, true), few);
#endif
  return good ? 0 : 1;
}

}  // namespace
}  // namespace enfilade::benchmarks

int main(int count, char** words) {
  return enfilade::benchmarks::main(count, words);
}
