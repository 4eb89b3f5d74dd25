// The frames of a capture: their cameras, and the snapshots that they show.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// A contact or near miss that is active in a tick.
struct ContactMark {
  Vec3 point = Vec3::Zero();  ///< where it began; scene frame, metres
  bool isNearMiss = false;
};

struct CaptureFrame {
  double time = 0;  ///< seconds
  render::Camera camera;
  scene::EntityId hiddenAvatar = 0;  ///< the viewing avatar, which is not drawn
  /// Null if the frame belongs to another shard.
  std::shared_ptr<const scene::Snapshot> snapshot;
  std::string name;                   ///< name of the script's capture, else empty
  std::vector<ContactMark> contacts;  ///< for an overlay of contacts
};

/// The name of an avatar that a script spawned.
struct AvatarName {
  scene::EntityId id = 0;
  std::string name;
};

/// The positions of an avatar's feet, ascending ticks.
struct AvatarTrail {
  struct Step {
    std::uint64_t tick = 0;
    Vec3 position = Vec3::Zero();  ///< scene frame, metres
  };
  scene::EntityId id = 0;
  std::vector<Step> steps;
};

struct CapturePlan {
  std::vector<CaptureFrame> frames;  ///< at least one; the index is the frame number in all shards
  std::vector<AvatarName> avatars;   ///< ascending ids
  std::vector<AvatarTrail> trails;   ///< of all avatars, for an overlay of paths
  std::vector<std::string> notes;    ///< messages about assumptions and ignored options
  std::size_t failedOrders = 0;      ///< failed orders of the script, described in notes
};

/// Reads the path and plans all frames; a walk script is run in this process. Only the snapshots of
/// `shard` are kept. Throws CameraPathError, protocol::ScriptError, scene::ImportError, and
/// std::invalid_argument for invalid cameras.
CapturePlan planCapture(const std::shared_ptr<const scene::Scene>& scene,
                        const std::filesystem::path& path, const PictureOptions& options,
                        const Shard& shard);

/// The text of a camera path's file. Throws CameraPathError.
std::string readPathFile(const std::filesystem::path& file);

/// True if frame `index` belongs to the shard.
inline bool isInShard(const Shard& shard, std::size_t index) {
  return index % shard.count == shard.index;
}

}  // namespace enfilade::server
