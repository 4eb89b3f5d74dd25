#include "server/capture/frame_times.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "scene/world/world.hpp"
#include "server/base/signal_handling.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kMaxSnapshotBytes = std::size_t{2} << 30;
constexpr double kMaxTicks = 10'000'000;  // of a path: more than a day

/// Estimates the bytes of a snapshot that it does not share with the previous one.
std::size_t estimateBytes(const scene::Snapshot& snapshot, const scene::Snapshot* before) {
  std::size_t bytes = sizeof snapshot + snapshot.avatars.size() * sizeof(scene::AvatarSnapshot);
  if (snapshot.bodies && (!before || before->bodies != snapshot.bodies))
    bytes += snapshot.bodies->size() * sizeof(scene::BodySnapshot);
  return bytes;
}

}  // namespace

void SnapshotStore::keep(const std::shared_ptr<const scene::Snapshot>& snapshot,
                         CaptureFrame& captureFrame) {
  captureFrame.snapshot = snapshot;
  if (snapshot == last_) return;
  bytes_ += estimateBytes(*snapshot, last_.get());
  last_ = snapshot;
  if (bytes_ > kMaxSnapshotBytes)
    throw CameraPathError(
        "the snapshots of all frames exceed 2 GiB; use fewer frames (walk script: a larger "
        "--every), or run the parts of --shard i/n one after the other");
}

void assignSnapshots(const std::shared_ptr<const scene::Scene>& scene, bool freezeScene,
                     const Shard& shard, std::vector<CaptureFrame>& captureFrames) {
  ENFILADE_ASSERT(!captureFrames.empty() &&
                  std::ranges::is_sorted(captureFrames, {}, &CaptureFrame::time));
  scene::World world(scene);
  const double tickSeconds = world.settings().tickDuration, begin = captureFrames.front().time;
  const bool moves = !freezeScene && !scene->model().bodies.empty();
  const double last = moves ? (captureFrames.back().time - begin) / tickSeconds : 0;
  if (!(last <= kMaxTicks))
    throw CameraPathError("the path takes " + std::to_string(last * tickSeconds) +
                          " s, which is too long for a scene with bodies; give --still, or "
                          "a path of less than " +
                          std::to_string(kMaxTicks * tickSeconds) + " s");
  SnapshotStore store;
  for (std::size_t i = 0; i < captureFrames.size(); ++i) {
    const auto due = moves ? static_cast<std::uint64_t>(
                                 std::llround((captureFrames[i].time - begin) / tickSeconds))
                           : std::uint64_t{0};
    while (world.snapshot()->tick < due) {
      if (isInterrupted()) throw Interrupted{};
      tickWorld(world);
    }
    if (isInShard(shard, i)) store.keep(world.snapshot(), captureFrames[i]);
  }
}

}  // namespace enfilade::server
