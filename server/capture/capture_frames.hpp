// The frames of a capture: their cameras, and the snapshots that they show.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "render/camera/camera.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::server {

using collision::Vec3;

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

}  // namespace enfilade::server
