#include "server/capture/frame_times.hpp"

#include <cmath>

#include "scene/world/world.hpp"
#include "server/base/signal_handling.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kMostBytes = std::size_t{2} << 30;
constexpr double kMostTicks = 10'000'000;  // of a path: a day and more

/// What a snapshot holds that the one before does not, about.
std::size_t bytesOf(const scene::Snapshot& snapshot, const scene::Snapshot* before) {
  std::size_t bytes = sizeof snapshot + snapshot.avatars.size() * sizeof(scene::AvatarView);
  if (snapshot.bodies && (!before || before->bodies != snapshot.bodies))
    bytes += snapshot.bodies->size() * sizeof(scene::BodyView);
  return bytes;
}

}  // namespace

void KeptSnapshots::keep(const std::shared_ptr<const scene::Snapshot>& snapshot, Shot& shot) {
  shot.snapshot = snapshot;
  if (snapshot == last_) return;
  bytes_ += bytesOf(*snapshot, last_.get());
  last_ = snapshot;
  if (bytes_ > kMostBytes)
    throw CameraPathError(
        "what moves takes more than 2 GiB over all frames; take fewer (a walk script: a larger "
        "--every), or --shard i/n one after the other");
}

void showMoments(const std::shared_ptr<const scene::Scene>& scene, bool still, const Shard& shard,
                 std::vector<Shot>& shots) {
  scene::World world(scene);
  const double tickSeconds = world.lengths().tick, begin = shots.front().time;
  const bool moves = !still && !scene->model().bodies.empty();
  const double last = moves ? (shots.back().time - begin) / tickSeconds : 0;
  if (!(last <= kMostTicks))
    throw CameraPathError("the path takes " + std::to_string(last * tickSeconds) +
                          " s, which is too long to let the scene's bodies move; give --still, or "
                          "a path of less than " +
                          std::to_string(kMostTicks * tickSeconds) + " s");
  KeptSnapshots kept;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const auto due =
        moves ? static_cast<std::uint64_t>(std::llround((shots[i].time - begin) / tickSeconds))
              : std::uint64_t{0};
    while (world.snapshot()->tick < due) {
      if (interrupted()) throw Interrupted{};
      tick(world);
    }
    if (takes(shard, i)) kept.keep(world.snapshot(), shots[i]);
  }
}

}  // namespace enfilade::server
