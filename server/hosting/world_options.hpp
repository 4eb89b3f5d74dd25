// What a served world is made with, beside its scene.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "scene/world/data/world_settings.hpp"
#include "server/base/server_limits.hpp"
#include "server/recording/recording_options.hpp"

namespace enfilade::server {

/// A recording that clients play.
struct PlayedRecording {
  std::filesystem::path file;
  std::uint64_t from = 0;  ///< the tick after which it stands at first
  std::uint32_t run = 1;   ///< of those in the file
};

struct WorldOptions {
  ServerLimits limits;
  scene::Lengths lengths;
  std::uint32_t auditEvery = 0;            ///< ticks; 0: none is audited
  std::optional<RecordingOptions> record;  ///< nullopt: nothing is written down
  /// The world is a recorded one, which has the lengths above, and `record` is for what branches
  /// off it; nullopt: it is new.
  std::optional<PlayedRecording> replay;
};

}  // namespace enfilade::server
