// Which moments of the world a capture's pictures show, and the snapshots that are kept for them.
#pragma once

#include "server/capture/capture_plan.hpp"

namespace enfilade::server {

/// Gives shots their snapshots, and bounds what these hold.
class KeptSnapshots {
 public:
  /// What nothing moved in is shared with the snapshot before and counts once. Throws
  /// CameraPathError when all take more than 2 GiB.
  void keep(const std::shared_ptr<const scene::Snapshot>& snapshot, Shot& shot);

 private:
  std::shared_ptr<const scene::Snapshot> last_;
  std::size_t bytes_ = 0;
};

/// Shots along a camera path, times ascending: the world begins with the first of them and is
/// ticked to each one's time, rounded to whole ticks; with `still`, or where the scene has nothing
/// that could move, all show its beginning. Only the shard's get snapshots, the same for any shard.
/// Throws CameraPathError where the path takes too long, and Interrupted.
void showMoments(const std::shared_ptr<const scene::Scene>& scene, bool still, const Shard& shard,
                 std::vector<Shot>& shots);

}  // namespace enfilade::server
