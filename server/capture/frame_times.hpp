// Assigns snapshots of the world to the frames of a capture, by their times.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "server/capture/capture_frames.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// Assigns snapshots to frames and limits their memory.
class SnapshotStore {
 public:
  /// Assigns a snapshot. Data shared with the previous snapshot counts once. Throws
  /// CameraPathError if all snapshots exceed 2 GiB.
  void keep(const std::shared_ptr<const scene::Snapshot>& snapshot, CaptureFrame& captureFrame);

 private:
  std::shared_ptr<const scene::Snapshot> last_;
  std::size_t bytes_ = 0;
};

/// Assigns snapshots to frames of a camera path with ascending times. The world starts at the first
/// frame and is ticked to each frame's time, rounded to whole ticks. With `freezeScene`, or without
/// bodies, all frames show the initial state. Only frames of the shard get snapshots; these do not
/// depend on the sharding. Throws CameraPathError if the path is too long, and Interrupted.
void assignSnapshots(const std::shared_ptr<const scene::Scene>& scene, bool freezeScene,
                     const Shard& shard, std::vector<CaptureFrame>& captureFrames);

}  // namespace enfilade::server
