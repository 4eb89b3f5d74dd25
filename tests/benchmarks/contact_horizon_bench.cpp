// Cost of contact horizons, a schedule of pairs, for a crowd in the bundled building. Compared with
// the examination of every pair near an avatar, and of every pair, in each tick. One run measures
// all, tick by tick, so their ratio does not depend on other load.
//
//   contact_horizon_bench [AVATARS [TICKS [OBJECTS]]]
//
// OBJECTS 0 is the bundled building; otherwise a district of so many. Avatars walk at 1.4 m/s and
// change direction every two seconds; the speed limit is 4 m/s.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "assets/building.hpp"
#include "scene/world/queries/contact_horizon.hpp"
#include "scene/world/queries/proximity_query.hpp"
#include "scene/world/world.hpp"
#include "tests/benchmarks/walkers.hpp"

namespace {

using namespace enfilade;
using namespace enfilade::benchmarks;
using scene::ContactHorizons;
using scene::Vec3;

constexpr int kTicksOfAllPairs = 3;  // they take seconds

/// A method, and its time in each tick.
struct Method {
  const char* name;
  ContactHorizons horizons;
  std::vector<double> seconds = {};

  void update(const scene::World& world) {
    const double start = readProcessorTime();
    horizons.update(world.snapshot());
    seconds.push_back(readProcessorTime() - start);
  }
};

double computeMean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

double findWorst(const std::vector<double>& values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

/// Seconds to compute the exact distance of each avatar from every other entity.
double examineAllPairs(const scene::World& world, scene::EntityIndex& index,
                       std::size_t& pairCount) {
  const scene::SceneAt at{index, *world.snapshot()};
  const auto& avatars = world.snapshot()->avatars;
  pairCount = 0;
  const double start = readProcessorTime();
  const auto examine = [&](scene::EntityId avatar, scene::EntityId other) {
    std::size_t work = scene::kMaxWorkPerEntity;
    computePairProximity(at, other, avatar, false, work);
    ++pairCount;
  };
  for (std::size_t i = 0; i < avatars.size(); ++i) {
    for (const std::uint32_t object : world.scene().solidObjects())
      examine(avatars[i].id, object + 1);
    for (const scene::BodySnapshot& body : *world.snapshot()->bodies)
      examine(avatars[i].id, body.id);
    for (std::size_t k = 0; k < i; ++k) examine(avatars[i].id, avatars[k].id);
  }
  return readProcessorTime() - start;
}

void printRow(const Method& method, double unit, int ticks) {
  const ContactHorizons::Statistics& counts = method.horizons.statistics();
  std::printf("| %-20s | %10.1f | %10.1f | %9.2f | %11.1f | %9.1f | %8.1f | %9llu |\n", method.name,
              1e6 * computeMean(method.seconds), 1e6 * findWorst(method.seconds),
              computeMean(method.seconds) / unit, static_cast<double>(counts.examinations) / ticks,
              static_cast<double>(counts.boxChecks) / ticks,
              static_cast<double>(counts.searches) / ticks,
              static_cast<unsigned long long>(counts.postponed));
}

void bench(std::size_t avatars, int ticks, std::size_t objects) {
  assets::BuildingOptions building;
  building.objects = objects;
  const auto staticScene = std::make_shared<const scene::Scene>(assets::makeBuilding(building));
  scene::WorldSettings settings;
  settings.maxSpeed = 4;
  scene::World world(staticScene, settings);
  std::mt19937_64 random(1);
  spawnAvatars(world, avatars, random);
  ContactHorizons::Options unlimited, everything;
  unlimited.maxWork = everything.maxWork = 1'000'000'000;
  everything.examineAll = true;
  std::vector<Method> methods;
  methods.push_back({"schedule", ContactHorizons(staticScene, settings, unlimited)});
  methods.push_back({"schedule, work limit", ContactHorizons(staticScene, settings)});
  methods.push_back({"all near pairs", ContactHorizons(staticScene, settings, everything)});
  for (Method& method : methods) method.horizons.select(std::nullopt);
  scene::EntityIndex index(staticScene);
  std::vector<double> allPairs;
  std::size_t pairCount = 0;
  double ahead = 0;
  std::size_t horizonCount = 0;
  for (int i = 0; i < ticks; ++i) {
    if (i % 120 == 0) turnAll(world, 1.4, random);
    tickWorld(world);
    for (Method& method : methods) method.update(world);
    if (i < kTicksOfAllPairs) allPairs.push_back(examineAllPairs(world, index, pairCount));
    for (const auto& [id, horizon] : methods[0].horizons.horizons()) {
      ahead += std::min(horizon.notBefore() - world.snapshot()->time, 10.0);
      ++horizonCount;
    }
  }
  std::printf("%zu objects, %zu avatars, %d ticks\n", staticScene->model().objects.size(),
              world.snapshot()->avatars.size(), ticks);
  std::printf(
      "| method               | mean us    | worst us   | ratio     | examined    | by boxes  | "
      "searches | postponed |\n|---|---|---|---|---|---|---|---|\n");
  const double unit = computeMean(methods[0].seconds);
  for (const Method& method : methods) printRow(method, unit, ticks);
  std::printf("| %-20s | %10.1f | %10.1f | %9.2f | %11.1f |           |          |           |\n",
              "all pairs", 1e6 * computeMean(allPairs), 1e6 * findWorst(allPairs),
              computeMean(allPairs) / unit, static_cast<double>(pairCount));
  std::printf("horizons lie %.1f ms ahead on average\n",
              1e3 * ahead / static_cast<double>(std::max<std::size_t>(horizonCount, 1)));
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int index, int otherwise) {
    return argc > index ? std::atoi(argv[index]) : otherwise;
  };
  bench(static_cast<std::size_t>(number(1, 100)), number(2, 300),
        static_cast<std::size_t>(number(3, 0)));
}
