// Options of a hosted world.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "scene/world/data/world_settings.hpp"
#include "server/base/server_limits.hpp"
#include "server/recording/recording_options.hpp"

namespace enfilade::server {

/// The recording that a world replays.
struct ReplayOptions {
  std::filesystem::path file;
  std::uint64_t startTick = 0;  ///< tick after which the replay starts
  std::uint32_t run = 1;        ///< number of the run in the file
};

/// Limits, settings, recording and replay of a world.
struct WorldOptions {
  ServerLimits limits;
  scene::WorldSettings settings;
  std::uint32_t auditEvery = 0;            ///< ticks; 0: never
  std::optional<RecordingOptions> record;  ///< nullopt: no recording
  /// The world replays this recording, with the settings above; `record` applies to its branches.
  /// nullopt: a new world.
  std::optional<ReplayOptions> replay;
};

}  // namespace enfilade::server
