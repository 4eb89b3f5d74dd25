// Serves a scene until a signal ends it.
#pragma once

#include "server/app/command_line.hpp"

namespace enfilade::server {

ExitCode serve(const ServeCommand& command);

}  // namespace enfilade::server
