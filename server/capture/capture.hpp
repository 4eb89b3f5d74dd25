// `enfilade capture`: pictures along a camera path, for makers of data sets.
#pragma once

#include "server/app/command_line.hpp"

namespace enfilade::server {

/// Throws what planShots() throws, render::RenderError, and std::runtime_error for a folder that
/// holds another capture or cannot be written. What was written by then is whole, and the same
/// command goes on from there.
ExitCode capture(const CaptureCommand& command);

}  // namespace enfilade::server
