// `enfilade export`: writes contacts and trajectories of a recording for other programs.
#pragma once

#include <filesystem>

#include "server/base/exit_code.hpp"

namespace enfilade::server {

struct ExportCommand {
  std::filesystem::path recording, out;
};

/// Throws protocol::mcap::RecordingError, and std::runtime_error for a folder that is not writable.
ExitCode exportRecording(const ExportCommand& command);

}  // namespace enfilade::server
