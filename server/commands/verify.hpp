// Makes a recorded walk again and looks whether every tick ends in the recorded state.
#pragma once

#include <filesystem>

#include "server/app/command_line.hpp"

namespace enfilade::server {

/// Tells what was found as one JSON object on stdout. `diverged`: some tick ended otherwise.
ExitCode verify(const VerifyCommand& command);

}  // namespace enfilade::server
