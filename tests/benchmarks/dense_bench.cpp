// Benchmark of walkers where triangles are dense, with an exact check of their contacts.
//
//   dense_bench [--quick] [--out FILE] [SCENE[@METRES_PER_UNIT]..]
//
// Ten avatars walk at 1.5 m/s in each scene of dense_scenes.hpp, at several numbers of triangles,
// and in SCENEs. The collision geometry is built before, as a server's prefetch does. The time of a
// tick is that of the processor: other load does not count. In every 20th tick the contacts of all
// avatars are compared with brute force: every triangle and hull, cold, by the exact
// comparison. FILE gets the rows as JSON lines, for dense_report.py.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "scene/import/cache/model_cache.hpp"
#include "scene/import/import_worker.hpp"
#include "tests/benchmarks/walkers.hpp"
#include "tests/scene/brute_force_contacts.hpp"
#include "tests/support/dense_scenes.hpp"

namespace {

using namespace enfilade;
using namespace enfilade::benchmarks;
using tests::DenseScene;

constexpr std::size_t kAvatars = 10;
constexpr int kTurnTicks = 120, kCheckTicks = 20;
constexpr double kSpeed = 1.5;  // m/s

struct Run {
  std::vector<double> tickSeconds;
  std::uint64_t queries = 0, parts = 0;
  std::size_t checked = 0, contacts = 0, wrong = 0;
  double maxPenetration = 0;
};

double computeQuantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values.at(static_cast<std::size_t>(q * double(values.size() - 1)));
}

void checkContacts(const scene::World& world, Run& run) {
  const scene::testing::ContactComparison compared = scene::testing::compareStaticContacts(world);
  ++run.checked;
  run.contacts += compared.expected;
  run.wrong += compared.different;
}

Run walk(scene::World& world, int ticks) {
  Run run;
  std::mt19937_64 random(1);
  spawnAvatars(world, kAvatars, random);
  for (int i = 0; i < ticks; ++i) {
    if (i % kTurnTicks == 0) turnAll(world, kSpeed, random);
    const double start = readProcessorTime();
    const scene::TickReport report = tickWorld(world);
    run.tickSeconds.push_back(readProcessorTime() - start);
    run.queries += report.narrowQueries;
    run.parts += report.partsLookedAt;
    run.maxPenetration = std::max(run.maxPenetration, report.maxPenetration);
    if (i % kCheckTicks == 0) checkContacts(world, run);
  }
  return run;
}

/// `name`, `description`: of the scene.
nlohmann::json measure(const std::string& name, const std::string& description, scene::Model model,
                       int ticks) {
  const auto scene = std::make_shared<const scene::Scene>(std::move(model));
  std::size_t made = 0;
  for (const scene::Object& object : scene->model().objects)
    for (const std::uint32_t mesh : object.meshes)
      made += scene->model().meshes[mesh].indices.size() / 3;
  for (const std::uint32_t object : scene->solidObjects()) scene->collisionGeometry(object);
  scene::World world(scene);
  setThreadCount(world, 1);
  const Run run = walk(world, ticks);
  const auto avatars = world.snapshot()->avatars.size();
  const double share = 1e6 / double(avatars);
  return {{"scene", name},
          {"description", description},
          {"objects", scene->model().objects.size()},
          {"triangles", made},
          {"avatars", avatars},
          {"ticks", ticks},
          {"avatar_us", share * computeQuantile(run.tickSeconds, 0.5)},
          {"tick_p99_us", 1e6 * computeQuantile(run.tickSeconds, 0.99)},
          {"tick_max_us", 1e6 * computeQuantile(run.tickSeconds, 1)},
          {"queries", double(run.queries) / ticks / double(avatars)},
          {"parts", double(run.parts) / ticks / double(avatars)},
          {"checked", run.checked},
          {"contacts", run.contacts},
          {"wrong", run.wrong},
          {"penetration_m", run.maxPenetration},
          {"state", world.snapshot()->stateHash}};
}

}  // namespace

int main(int argc, char** argv) {
  if (const auto status = scene::runImportWorker(argc, argv)) return *status;
  bool quick = false;
  std::ofstream out;
  std::vector<std::string> files;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--quick")
      quick = true;
    else if (word == "--out" && i + 1 < argc)
      out.open(argv[++i]);
    else
      files.emplace_back(word);
  }
  const int ticks = quick ? 240 : 1200;
  const std::vector<std::size_t> sizes =
      quick ? std::vector<std::size_t>{30'000, 100'000}
            : std::vector<std::size_t>{30'000, 100'000, 1'000'000, 5'000'000};
  std::size_t wrong = 0;
  const auto write = [&](const nlohmann::json& row) {
    std::printf("%s\n", row.dump().c_str());
    std::fflush(stdout);
    if (out.is_open()) out << row.dump() << std::endl;
    wrong += row["wrong"].get<std::size_t>();
  };
  for (const DenseScene& dense : tests::listDenseScenes())
    for (const std::size_t triangles : sizes)
      write(measure(dense.name, dense.description, dense.make(triangles), ticks));
  for (const std::string& name : files) {
    scene::ImportOptions options;
    const std::filesystem::path file = name.substr(0, name.find('@'));
    if (const auto at = name.find('@'); at != std::string::npos)
      options.metresPerUnit = std::stod(name.substr(at + 1));
    write(measure(file.filename().string(), "",
                  scene::loadModel(file, options, scene::findDefaultModelCache()).model, ticks));
  }
  return wrong == 0 ? 0 : 1;
}
