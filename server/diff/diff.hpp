// `enfilade diff`: what changed between two recorded walks.
#pragma once

#include "server/app/command_line.hpp"

namespace enfilade::server {

/// `violations`: something got worse. Throws protocol::mcap::RecordingError.
ExitCode diff(const DiffCommand& command);

}  // namespace enfilade::server
