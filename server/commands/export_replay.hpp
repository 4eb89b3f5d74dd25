// `enfilade export RECORDING --html FILE`: a recorded walk as one HTML file that replays it in a
// browser without a server.
#pragma once

#include <cstdint>
#include <filesystem>

#include "server/base/exit_code.hpp"

namespace enfilade::server {

struct ExportReplayCommand {
  std::filesystem::path recording, html;
  std::filesystem::path scene;  ///< empty: the model that the recording names
  std::uint32_t run = 1;
  double maxMegabytes = 50;  ///< of the file; above, textures are left out, then pictures
  bool cache = true;         ///< use a cached import
};

/// Throws protocol::mcap::RecordingError, scene::ImportError, and std::runtime_error if the file is
/// too large or cannot be written.
ExitCode exportReplay(const ExportReplayCommand& command);

}  // namespace enfilade::server
