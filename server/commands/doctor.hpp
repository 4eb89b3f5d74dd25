// What can draw on this machine, and what is missing.
#pragma once

#include "server/app/command_line.hpp"

namespace enfilade::server {

/// Tries each EGL device, draws a proof picture, tells what came of it on stdout. `runtimeError`
/// when no frame can be made that is right.
ExitCode doctor(const DoctorCommand& command);

}  // namespace enfilade::server
