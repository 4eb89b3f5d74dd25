// `enfilade serve`: serves scenes until a signal stops the server.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "scene/world/data/world_settings.hpp"
#include "server/base/access.hpp"
#include "server/base/drawing_options.hpp"
#include "server/base/exit_code.hpp"
#include "server/base/host_port.hpp"
#include "server/base/load_scene.hpp"
#include "server/recording/recording_options.hpp"

namespace enfilade::server {

struct ServeCommand {
  ModelOptions model;  ///< its file is empty if `recording` names the scene
  HostPort listen{"127.0.0.1", 7878};
  std::uint32_t auditEvery = 0;  ///< ticks; 0: never
  scene::WorldSettings settings;
  std::filesystem::path tokenFile;  ///< empty: no tokens, all clients have all rights
  Access access;                    ///< without the tokens
  bool stopAtEndOfInput = false;    ///< stop when standard input is closed
  DrawingOptions drawing;
  std::vector<std::filesystem::path> furtherScenes;  ///< imported with the options of `model`
  RecordingChoice record;
  /// The recording that clients play, starting after tick `from` (nullopt: its first); empty: a
  /// new world. The settings are then those of the recording.
  std::filesystem::path recording = {};
  std::optional<std::uint64_t> from = {};
  std::uint32_t run = 1;  ///< number of the run in the recording
};

ExitCode serve(const ServeCommand& command);

}  // namespace enfilade::server
