// Benchmark of a tick with walking avatars in a real or the bundled scene, by stage, in
// microseconds.
//
//   tick_bench [SCENE [AVATARS [TICKS [THREADS]]]]
//
// SCENE is a file, or district:N for a generated district of N objects. scan:N, office:N,
// plant_room:N and terrain:N are generated scenes of some N triangles (dense_scenes.hpp). Avatars
// walk at 1.5 m/s towards seeded places and change direction every two seconds, like visitors of a
// building. THREADS: at most, of a tick (default: two). Contacts are computed each tick. The
// maximum penetration is printed with the times, so that no speed is bought with an error.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <random>

#include "assets/building.hpp"
#include "scene/import/cache/model_cache.hpp"
#include "scene/import/import_worker.hpp"
#include "scene/world/world.hpp"
#include "tests/benchmarks/walkers.hpp"
#include "tests/scene/thin_geometry.hpp"
#include "tests/support/dense_scenes.hpp"
#include "tests/support/shared_folder.hpp"

namespace {

using namespace enfilade;
using namespace enfilade::benchmarks;
using scene::Notice;
using scene::Vec3;

double computeQuantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[static_cast<std::size_t>(q * double(values.size() - 1))];
}

void printRow(const char* name, const std::vector<double>& seconds) {
  std::printf("| %-8s | %9.1f | %9.1f | %9.1f |\n", name, 1e6 * computeQuantile(seconds, 0.5),
              1e6 * computeQuantile(seconds, 0.99), 1e6 * computeQuantile(seconds, 1));
}

double readPeakMegabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

scene::Model loadNamedModel(const std::filesystem::path& file) {
  const std::string name = file.string();
  const std::size_t colon = name.find(':');
  if (colon == std::string::npos)
    return scene::loadModel(file, {}, scene::findDefaultModelCache()).model;
  const std::string kind = name.substr(0, colon);
  const std::size_t number = std::stoul(name.substr(colon + 1));
  if (const tests::DenseScene* dense = tests::findDenseScene(kind)) return dense->make(number);
  assets::BuildingOptions options;
  options.objects = number;
  return assets::makeBuilding(options);
}

std::shared_ptr<const scene::Scene> load(const std::filesystem::path& file) {
  const auto start = std::chrono::steady_clock::now();
  auto staticScene = std::make_shared<const scene::Scene>(loadNamedModel(file));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  std::printf("%s: %zu objects loaded in %.2f s, %.0f MB at most\n", file.c_str(),
              staticScene->model().objects.size(), took.count(), readPeakMegabytes());
  return staticScene;
}

/// Runs the ticks, with `before` called before each, and prints their cost.
void measure(const std::string& title, scene::World& world, int ticks,
             const std::function<void(int tick)>& before) {
  std::array<std::vector<double>, scene::kStageCount> stages;
  std::vector<double> whole, processor, allProcessors;
  double worst = 0;
  std::uint64_t queries = 0, rationals = 0, pairs = 0, bounded = 0;
  for (int i = 0; i < ticks; ++i) {
    before(i);
    const double start = readProcessorTime(), startOfAll = readTimeOfAllThreads();
    const scene::TickReport report = tickWorld(world);
    processor.push_back(readProcessorTime() - start);
    allProcessors.push_back(readTimeOfAllThreads() - startOfAll);
    double sum = 0;
    for (std::size_t s = 0; s < scene::kStageCount; ++s) {
      stages[s].push_back(report.stageSeconds[s]);
      sum += report.stageSeconds[s];
    }
    whole.push_back(sum);
    worst = std::max(worst, report.maxPenetration);
    queries += report.narrowQueries;
    rationals += report.rationalQueries;
    pairs += report.pairs;
    bounded += report.iterationLimitedCasts;
  }
  std::printf("%s: %zu objects, %zu avatars, %d ticks\n", title.c_str(),
              world.scene().model().objects.size(), world.snapshot()->avatars.size(), ticks);
  std::printf("| stage    | median us |    p99 us |    max us |\n|---|---|---|---|\n");
  for (std::size_t s = 0; s < scene::kStageCount; ++s) printRow(scene::kStageNames[s], stages[s]);
  printRow("tick", whole);
  printRow("main CPU", processor);
  printRow("all CPUs", allProcessors);
  std::printf(
      "a tick: %.1f pairs, %.1f narrow queries, %.3f of them rational; "
      "%llu sweeps bounded; worst penetration %g m; state hash %016llx\n",
      double(pairs) / ticks, double(queries) / ticks, double(rationals) / ticks,
      static_cast<unsigned long long>(bounded), worst,
      static_cast<unsigned long long>(world.snapshot()->stateHash));
}

void bench(const std::filesystem::path& file, int avatars, int ticks, int threads) {
  const auto staticScene = load(file);
  scene::World world(staticScene);
  setThreadCount(world, threads);
  std::mt19937_64 random(1);
  spawnAvatars(world, static_cast<std::size_t>(avatars), random);
  measure(file.string(), world, ticks, [&](int i) {
    if (i % 120 != 0) return;
    spawnAvatars(world, static_cast<std::size_t>(avatars), random);
    turnAll(world, 1.5, random);
  });
}

/// 200 avatars walk in both directions along a corridor of 4 m and block one another.
void benchCrowd(int ticks) {
  constexpr int kCrowd = 200;
  scene::testing::Builder builder;
  scene::testing::addSheetCell(builder, "corridor", {-30, 0, -2}, {30, 3, 2}, false);
  scene::World world(std::make_shared<const scene::Scene>(builder.model));
  const auto name = [](int i) { return "walker" + std::to_string(i); };
  for (int i = 0; i < kCrowd; ++i)
    submitAvatarCommand(world, {name(i), scene::Spawn{{-24.5 + i / 4, 0, -1.5 + i % 4}}, 0});
  tickWorld(world);
  measure("a crowd in a corridor", world, ticks, [&](int i) {
    if (i % 120 != 0) return;
    for (int k = 0; k < kCrowd; ++k) {
      const double along = (k + i / 120) % 2 ? 1.3 : -1.3;
      submitAvatarCommand(world, {name(k), scene::Drive{{along, 0, 0.3 - 0.2 * (k % 4)}}, 0});
    }
  });
}

/// The bundled building, and the shared estate of 16,395 objects if present.
std::vector<std::filesystem::path> listDefaultScenes(const char* program) {
  const auto built = std::filesystem::absolute(program).parent_path().parent_path();
  std::vector<std::filesystem::path> scenes{built / "assets/building.glb"};
  if (const auto shared = tests::findSharedFolder())
    scenes.push_back(*shared / "scenes/schependomlaan/schependomlaan_estate.glb");
  return scenes;
}

}  // namespace

int main(int argc, char** argv) {
  if (const auto code = scene::runImportWorker(argc, argv)) return *code;
  const int avatars = argc > 2 ? std::atoi(argv[2]) : 10;
  const int ticks = argc > 3 ? std::atoi(argv[3]) : 3000;
  const int threads = argc > 4 ? std::atoi(argv[4]) : 0;
  if (argc > 1) {
    bench(argv[1], avatars, ticks, threads);
  } else {
    for (const auto& scene : listDefaultScenes(argv[0])) bench(scene, avatars, ticks, threads);
    benchCrowd(600);
  }
}
