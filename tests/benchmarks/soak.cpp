// Soak test: ten avatars walk random seeded paths through the bundled building as fast as possible,
// with doors and lift in use. Every tick is audited within the audit's budget.
//
//   soak [TICKS [SCENE]]     1000000
//
// Memory is sampled and may not grow after a tenth of the ticks. Exit code 3: memory grew, the
// audit had a finding, or something penetrated.
#include <malloc.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "scene/import/cache/model_cache.hpp"
#include "scene/import/import_worker.hpp"
#include "scene/world/world.hpp"
#include "server/base/audit_log.hpp"
#include "server/base/load_scene.hpp"
#include "tests/support/server_load.hpp"

namespace {

using namespace enfilade;
using scene::BodyKind;
using scene::Vec3;

constexpr int kAvatars = 10;
constexpr int kTurnEvery = 120;         // ticks: all avatars get new directions
constexpr int kBodyEvery = 300;         // ticks: one door or lift gets a command
constexpr int kTripEvery = 20'000;      // ticks: all avatars leave and return elsewhere
constexpr double kGrowthAllowed = 4e6;  // bytes, after a tenth of the ticks: the allocator's
                                        // rounding

class Soak {
 public:
  explicit Soak(std::shared_ptr<const scene::Scene> scene)
      : places_(tests::findStandingPlaces(scene, 8 * kAvatars, 1)), world_(std::move(scene)) {
    // Parts are built lazily when an avatar first comes near. All are built now, so that a first
    // visit does not look like growth.
    for (const std::uint32_t object : world_.scene().solidObjects())
      world_.scene().collisionGeometry(object);
    scene::setAuditInterval(world_, 1);
  }

  void step(std::uint64_t tick) {
    if (tick % kTripEvery == 0) trip();
    if (tick % kTurnEvery == 0) turn();
    if (tick % kBodyEvery == 0) useBody();
    const scene::TickReport report = scene::tickWorld(world_);
    if (report.audit) audit_.addTick(*report.audit);
    worst_ = std::max(worst_, report.maxPenetration);
    contacts_ += report.contacts.size();
    notices_ += report.notices.size();
  }

  bool hasPassed() const { return audit_.isClean() && worst_ == 0; }
  void printRow() const {
    std::printf(
        "%llu ticks audited, %llu pairs, %llu missed, %llu extra; worst penetration %g m; "
        "%llu contact events, %llu notices; state hash %016llx\n",
        static_cast<unsigned long long>(audit_.ticks),
        static_cast<unsigned long long>(audit_.pairs),
        static_cast<unsigned long long>(audit_.missed),
        static_cast<unsigned long long>(audit_.extra), worst_,
        static_cast<unsigned long long>(contacts_), static_cast<unsigned long long>(notices_),
        static_cast<unsigned long long>(world_.snapshot()->stateHash));
  }

 private:
  void trip() {
    for (const scene::AvatarSnapshot& avatar : world_.snapshot()->avatars) {
      scene::submitAvatarCommand(world_, {avatar.name, scene::Drive{}, 0});
      scene::submitAvatarCommand(world_, {avatar.name, scene::Leave{}, 0});
    }
    for (int i = 0; i < kAvatars; ++i) {
      const Vec3& place = places_[random_() % places_.size()];
      // The names are reused: each spawn is queued behind its leave.
      scene::submitAvatarCommand(world_, {"walker" + std::to_string(i), scene::Spawn{place}, 0});
    }
  }
  void turn() {
    for (const scene::AvatarSnapshot& avatar : world_.snapshot()->avatars) {
      const Vec3 goal = places_[random_() % places_.size()];
      if (random_() % 2 == 0) {
        scene::submitAvatarCommand(world_, {avatar.name, scene::Walk{{goal}}, 0});
        continue;
      }
      Vec3 way = goal - avatar.footPosition;
      way.y() = 0;
      if (way.norm() > 0) {
        scene::submitAvatarCommand(world_, {avatar.name, scene::Drive{1.5 * way.normalized()}, 0});
      }
    }
  }
  void useBody() {
    const auto& bodies = world_.scene().model().bodies;
    if (bodies.empty()) return;
    const scene::BodySpec& spec = bodies[random_() % bodies.size()];
    scene::BodyCommand command;
    command.body = spec.name;
    using Action = scene::BodyCommand::Action;
    if (spec.kind == BodyKind::lift) {
      command.action = Action::moveToLevel;
      command.level =
          static_cast<std::uint32_t>(random_() % std::max<std::size_t>(1, spec.stops.size()));
    } else if (spec.kind == BodyKind::path) {
      command.action = Action::run;
    } else {
      command.action = random_() % 2 == 0 ? Action::open : Action::close;
    }
    scene::submitBodyCommand(world_, command);  // a trigger refuses the command
  }

  std::mt19937_64 random_{7};
  std::vector<Vec3> places_;
  scene::World world_;
  server::AuditTotals audit_;
  double worst_ = 0;
  std::uint64_t contacts_ = 0, notices_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (const auto code = scene::runImportWorker(argc, argv)) return *code;
  spdlog::set_level(spdlog::level::warn);
  const std::uint64_t ticks = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1'000'000;
  server::ModelOptions model;
  model.file = argc > 2 ? std::filesystem::path(argv[2])
                        : std::filesystem::absolute(argv[0]).parent_path().parent_path() /
                              "assets/building.glb";
  Soak soak(server::loadScene(model));
  const std::uint64_t sampleEvery = std::max<std::uint64_t>(1, ticks / 20), warm = ticks / 10;
  double afterWarmUp = 0, maxResident = 0;
  const auto start = std::chrono::steady_clock::now();
  for (std::uint64_t tick = 0; tick < ticks; ++tick) {
    soak.step(tick);
    if (tick % sampleEvery != 0 && tick + 1 != ticks) continue;
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    ::malloc_trim(0);  // memory cached by the allocator is not growth
    const double resident = static_cast<double>(tests::measureFootprint().residentBytes);
    if (tick < warm) afterWarmUp = resident;
    maxResident = std::max(maxResident, tick >= warm ? resident : 0);
    if (tick >= warm && afterWarmUp == 0) afterWarmUp = resident;
    std::printf("tick %llu: %.1f MB resident, %.0f ticks a second\n",
                static_cast<unsigned long long>(tick), 1e-6 * resident,
                static_cast<double>(tick + 1) / took.count());
    std::fflush(stdout);
  }
  soak.printRow();
  const bool flat = maxResident <= afterWarmUp + kGrowthAllowed;
  std::printf("memory after the warm-up: %+.1f MB\n", 1e-6 * (maxResident - afterWarmUp));
  return soak.hasPassed() && flat ? 0 : 3;
}
