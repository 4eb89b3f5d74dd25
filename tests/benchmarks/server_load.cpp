// Load test: many clients of one server on loopback, all in this process; then many short visits.
//
//   server_load [CLIENTS [SECONDS [VISITS [STATE_RATE [WATCH_EVERY]]]]]     200 10 2000 0 10
//
// Each client drives an avatar through the bundled building with 60 commands a second and receives
// contacts. One of WATCH_EVERY also receives states (STATE_RATE a second; 0: of each tick) to
// measure the latency from a command to a state. With states for all 200 clients this process would
// parse 2.4 million avatars a second and measure its own lateness. Exit code 3: something was lost,
// duplicated or leaked.
#include <malloc.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "protocol/clients/cpp/client.hpp"
#include "scene/import/cache/model_cache.hpp"
#include "scene/import/import_worker.hpp"
#include "server/base/load_scene.hpp"
#include "server/net/server.hpp"
#include "tests/support/server_load.hpp"

namespace {

using namespace enfilade;

std::uint64_t computeQuantile(const std::vector<std::uint64_t>& sorted, double q) {
  return sorted.empty() ? 0 : sorted[static_cast<std::size_t>(q * double(sorted.size() - 1))];
}

double readProcessSeconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

void printRow(const v1::StageTiming& timing) {
  std::printf("| %-8s | %9.0f | %9.0f | %9.0f |\n", timing.name().c_str(), timing.median_us(),
              timing.p99_us(), timing.max_us());
}

void printRow(const v1::Metrics& metrics) {
  std::printf("| stage    | median us |    p99 us |    max us |\n|---|---|---|---|\n");
  for (const v1::StageTiming& stage : metrics.stages()) printRow(stage);
  printRow(metrics.tick());
  std::printf("maximum penetration %g m; %llu State messages and images dropped\n",
              metrics.worst_penetration(), static_cast<unsigned long long>(metrics.dropped()));
}

void printRow(const tests::LoadResult& result, double processor) {
  std::printf("%llu clients, %llu ticks in %.2f s (%.1f a second), %.2f CPU cores used\n",
              static_cast<unsigned long long>(result.clients),
              static_cast<unsigned long long>(result.ticks), result.wallSeconds,
              double(result.ticks) / result.wallSeconds, processor / result.wallSeconds);
  std::printf(
      "%llu commands (%llu unsent: too slow here), %llu replies, %llu refused; %llu TickEvents, "
      "%llu begins, %llu ends\n",
      static_cast<unsigned long long>(result.commands),
      static_cast<unsigned long long>(result.unsent),
      static_cast<unsigned long long>(result.replies),
      static_cast<unsigned long long>(result.refused),
      static_cast<unsigned long long>(result.tickEvents),
      static_cast<unsigned long long>(result.begins), static_cast<unsigned long long>(result.ends));
  std::printf("%llu states read, %llu dropped\n", static_cast<unsigned long long>(result.states),
              static_cast<unsigned long long>(result.droppedStates));
  for (const auto& [name, ticks] :
       {std::pair{"taken", &result.acceptedToShown}, std::pair{"sent", &result.sentToShown}}) {
    std::printf("ticks from %s to shown: p50 %llu, p99 %llu, maximum %llu, of %zu commands\n", name,
                static_cast<unsigned long long>(computeQuantile(*ticks, 0.5)),
                static_cast<unsigned long long>(computeQuantile(*ticks, 0.99)),
                static_cast<unsigned long long>(computeQuantile(*ticks, 1)), ticks->size());
  }
  for (const std::string& fault : result.faults) std::printf("FAULT %s\n", fault.c_str());
}

server::ServerOptions makeCrowdOptions() {
  server::ServerOptions options;
  options.world.limits.connections = 4096;
  return options;
}

bool load(const std::shared_ptr<const scene::Scene>& scene, int clients, double seconds,
          double stateRate, std::size_t watchEvery) {
  server::Server server(scene, {"127.0.0.1", 0}, makeCrowdOptions());
  tests::LoadOptions options;
  options.port = server.port();
  options.places = tests::findStandingPlaces(scene, clients, 1);
  options.seconds = seconds;
  options.stateRate = stateRate;
  options.watchEvery = watchEvery;
  const double before = readProcessSeconds();
  double used = 0;
  v1::Metrics metrics;
  const auto atEnd = [&] {
    used = readProcessSeconds() - before;
    metrics = protocol::Client("127.0.0.1", server.port()).metrics();
  };
  const tests::LoadResult result = tests::runLoad(options, atEnd, [&] { server.stop(); });
  printRow(result, used);
  printRow(metrics);
  return result.faults.empty() && result.begins == result.ends;
}

void printRow(const char* when, const tests::Footprint& now) {
  std::printf("%-18s %7.1f MB resident, %llu descriptors, %llu threads\n", when,
              1e-6 * static_cast<double>(now.residentBytes),
              static_cast<unsigned long long>(now.descriptors),
              static_cast<unsigned long long>(now.threads));
}

/// Returns when the server has dropped all clients except the calling one.
bool waitUntilSettled(protocol::Client& client) {
  constexpr int kTries = 1000;
  const auto alone = [&] {
    const v1::Metrics metrics = client.metrics();
    return metrics.clients() == 1 && metrics.avatars() == 0;
  };
  for (int i = 0; i < kTries && !alone(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  ::malloc_trim(0);  // memory cached by the allocator is not a leak
  return alone();
}

bool visit(const std::shared_ptr<const scene::Scene>& scene, int visits) {
  constexpr double kGrowth = 2e6;  // bytes; 2,000 sessions hold over 100 MB
  server::Server server(scene, {"127.0.0.1", 0}, makeCrowdOptions());
  protocol::Client stays("127.0.0.1", server.port());
  v1::SetClock freely;  // so that avatars spawn, and leave with their clients
  freely.mutable_free_run()->set_speed(10);
  stays.setClock(freely);
  tests::visitRudely(server.port(), visits / 10, 1);
  if (!waitUntilSettled(stays)) return false;
  const tests::Footprint before = tests::measureFootprint();
  tests::visitRudely(server.port(), visits, 2);
  const bool alone = waitUntilSettled(stays);
  const tests::Footprint after = tests::measureFootprint();
  std::printf("%d visits:\n", visits);
  printRow("before", before);
  printRow("after", after);
  return alone && after.descriptors == before.descriptors && after.threads == before.threads &&
         double(after.residentBytes) < double(before.residentBytes) + kGrowth;
}

}  // namespace

int main(int argc, char** argv) {
  if (const auto code = scene::runImportWorker(argc, argv)) return *code;
  spdlog::set_level(spdlog::level::warn);
  const int clients = argc > 1 ? std::atoi(argv[1]) : 200;
  const double seconds = argc > 2 ? std::atof(argv[2]) : 10;
  const int visits = argc > 3 ? std::atoi(argv[3]) : 2000;
  const double stateRate = argc > 4 ? std::atof(argv[4]) : 0;
  const std::size_t watchEvery = argc > 5 ? std::strtoul(argv[5], nullptr, 10) : 10;
  const auto built = std::filesystem::absolute(argv[0]).parent_path().parent_path();
  server::ModelOptions model;
  model.file = built / "assets/building.glb";
  const auto scene = server::loadScene(model);
  const bool right = load(scene, clients, seconds, stateRate, std::max<std::size_t>(1, watchEvery));
  const bool clean = visits == 0 || visit(scene, visits);
  return right && clean ? 0 : 3;
}
