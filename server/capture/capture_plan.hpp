// The pictures that a capture takes: each with its camera and the moment that it shows.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// A contact or a near miss that lives in a tick.
struct ContactMark {
  Vec3 point = Vec3::Zero();  ///< scene frame, metres: where it began
  bool near = false;
};

struct Shot {
  double time = 0;  ///< seconds
  render::Camera camera;
  scene::EntityId hidden = 0;  ///< not drawn: whose eyes these are
  /// Null where another shard takes this picture.
  std::shared_ptr<const scene::Snapshot> snapshot;
  std::string name;                   ///< of the script's capture, else empty
  std::vector<ContactMark> contacts;  ///< with an overlay of them
};

/// Someone who comes in while a script runs; the scene's own things are in its model.
struct WalkerName {
  scene::EntityId id = 0;
  std::string name;
};

/// Where someone's feet came, ascending ticks.
struct WalkTrail {
  struct Step {
    std::uint64_t tick = 0;
    Vec3 at = Vec3::Zero();  ///< scene frame, metres
  };
  scene::EntityId id = 0;
  std::vector<Step> feet;
};

struct ShotList {
  std::vector<Shot> shots;          ///< at least one; shot i is frame i, whatever the shard
  std::vector<WalkerName> walkers;  ///< ascending ids
  std::vector<WalkTrail> trails;    ///< of all walkers, with an overlay of paths
  std::vector<std::string> notes;   ///< what was guessed or left out, for a person
  std::size_t wentWrong = 0;  ///< orders of a script that were refused, blocked, ...: in notes
};

/// Reads the path and works out every picture of it: a walk script runs in process for that.
/// `shard` says which snapshots are kept. Throws CameraPathError, protocol::ScriptError,
/// scene::ImportError; std::invalid_argument for cameras that render::refusal() refuses.
ShotList planShots(const std::shared_ptr<const scene::Scene>& scene,
                   const std::filesystem::path& path, const PictureOptions& options,
                   const Shard& shard);

/// Whether frame `index` is the shard's.
inline bool takes(const Shard& shard, std::size_t index) {
  return index % shard.count == shard.index;
}

}  // namespace enfilade::server
