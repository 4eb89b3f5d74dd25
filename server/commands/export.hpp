// `enfilade export`: a recording's contacts and ways as files that other programs read.
#pragma once

#include "server/app/command_line.hpp"

namespace enfilade::server {

/// Throws protocol::mcap::RecordingError, and std::runtime_error for a folder that cannot be
/// written.
ExitCode exportRecording(const ExportCommand& command);

}  // namespace enfilade::server
