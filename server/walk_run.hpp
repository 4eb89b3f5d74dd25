// Runs a walk script from its file to its report; the world is in this process (replay) or behind a
// socket (walk).
#pragma once

#include "server/command_line.hpp"

namespace enfilade::server {

ExitCode replay(const ReplayCommand& command);
ExitCode walk(const WalkCommand& command);

}  // namespace enfilade::server
