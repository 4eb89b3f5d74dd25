// Benchmark of navigation: random pairs of places, the time of a path with its proof, and a check
// by the world: an avatar walks each path that was found.
//
//   navigation_bench [--quick] [--out FILE] SCENE..
//
// A path counts as wrong if its walk is blocked, leaves the scene or penetrates anything. FILE gets
// a JSON line per scene.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/import/import_model.hpp"
#include "scene/import/import_worker.hpp"
#include "scene/navigation/navigation.hpp"
#include "server/base/load_scene.hpp"
#include "tests/benchmarks/measurement.hpp"

namespace {

using namespace enfilade;
using namespace enfilade::benchmarks;
using scene::Vec3;

constexpr int kMaxTicks = 60 * 3600;  // an hour

struct Walked {
  bool arrived = false;
  double penetration = 0;
  std::string text;
};

Walked walk(scene::World& world, int number, const scene::NavigationPath& path,
            const scene::NavigationAgent& agent) {
  const std::string name = "walker" + std::to_string(number);
  scene::Spawn spawn;
  spawn.position = path.points.front();
  spawn.radius = agent.radius;
  spawn.height = agent.height;
  submitAvatarCommand(world, {name, spawn, 0});
  scene::Walk order;
  order.waypoints.assign(path.points.begin() + 1, path.points.end());
  order.speed = agent.speed;
  if (const auto error = submitAvatarCommand(world, {name, order, 0})) return {false, 0, *error};
  Walked walked;
  for (int tick = 0; tick < kMaxTicks && walked.text.empty(); ++tick) {
    const scene::TickReport report = tickWorld(world);
    walked.penetration = std::max(walked.penetration, report.maxPenetration);
    for (const scene::Notice& notice : report.notices) {
      if (notice.avatar != name) continue;
      using Kind = scene::Notice::Kind;
      if (notice.kind == Kind::arrived) walked = {true, walked.penetration, "arrived"};
      if (notice.kind == Kind::blocked || notice.kind == Kind::refused || notice.kind == Kind::left)
        walked.text = notice.text + " " + findEntityName(world, notice.obstacle);
    }
  }
  submitAvatarCommand(world, {name, scene::Drive{}, 0});
  submitAvatarCommand(world, {name, scene::Leave{}, 0});
  tickWorld(world);
  return walked;
}

void measure(const std::string& file, int pairs, nlohmann::json& row) {
  server::ModelOptions options;
  options.file = file;
  options.doors = scene::IfcDoors::open;
  const auto scene = server::loadSceneTimed(options).scene;
  const scene::WorldSettings settings;
  const scene::NavigationAgent agent;
  scene::Navigation navigation(scene, settings, agent);
  scene::World world(scene, settings);
  std::mt19937_64 random(1);
  std::vector<double> seconds, foundSeconds, ratios;
  std::map<std::string, int> reasons;
  int found = 0, wrong = 0, sameIslandUnfound = 0;
  double penetration = 0, metres = 0;
  for (int i = 0; i < pairs; ++i) {
    const auto from = navigation.findRandomPlace(random, {});
    const auto to = navigation.findRandomPlace(random, {});
    if (!from || !to) break;
    const auto start = Clock::now();
    const scene::NavigationPath path = navigation.findPath(*from, *to);
    seconds.push_back(secondsSince(start));
    if (!path.found()) {
      ++reasons[path.reason];
      if (navigation.islandOf(*from) == navigation.islandOf(*to)) ++sameIslandUnfound;
      continue;
    }
    ++found;
    foundSeconds.push_back(seconds.back());
    metres += path.length;
    const Walked walked = walk(world, i, path, agent);
    penetration = std::max(penetration, walked.penetration);
    if (walked.arrived && walked.penetration == 0) continue;
    if (++wrong <= 5)
      std::printf("  wrong: (%.17g, %.17g, %.17g) to (%.17g, %.17g, %.17g): %s\n", from->x(),
                  from->y(), from->z(), to->x(), to->y(), to->z(), walked.text.c_str());
  }
  const auto report = navigation.report();
  row = {{"scene", std::filesystem::path(file).filename().string()},
         {"build_seconds", report.seconds},
         {"polygons", report.polygons},
         {"area", report.area},
         {"islands", report.islandAreas.size()},
         {"megabytes", static_cast<double>(report.bytes) * 1e-6},
         {"pairs", seconds.size()},
         {"found", found},
         {"wrong", wrong},
         {"not_found_on_one_island", sameIslandUnfound},
         {"mean_metres", found > 0 ? metres / found : 0},
         {"max_penetration", penetration},
         {"median_us", number(1e6 * quantile(foundSeconds, 0.5))},
         {"p99_us", number(1e6 * quantile(foundSeconds, 0.99))},
         {"all_p99_us", number(1e6 * quantile(seconds, 0.99))}};
  std::printf("%s\n", row.dump().c_str());
  std::vector<std::pair<int, std::string>> often;
  for (const auto& [reason, count] : reasons) often.emplace_back(count, reason);
  std::sort(often.rbegin(), often.rend());
  for (std::size_t i = 0; i < std::min<std::size_t>(4, often.size()); ++i)
    std::printf("  %d not found: %s\n", often[i].first, often[i].second.c_str());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (const auto status = scene::runImportWorker(argc, argv)) return *status;
  std::string out;
  int pairs = 10'000;
  std::vector<std::string> scenes;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--quick") {
      pairs = 200;
    } else if (argument == "--out" && i + 1 < argc) {
      out = argv[++i];
    } else {
      scenes.push_back(argument);
    }
  }
  if (scenes.empty()) {
    std::fprintf(stderr, "usage: %s [--quick] [--out FILE] SCENE..\n", argv[0]);
    return 2;
  }
  std::ofstream file(out);
  for (const std::string& name : scenes) {
    nlohmann::json row;
    measure(name, pairs, row);
    if (!out.empty()) file << row.dump() << "\n";
  }
}
