// The program without its main(), so that tests can call it.
#pragma once

#include "server/base/exit_code.hpp"

namespace enfilade::server {

/// Parses the command line and runs the command. Errors go to stderr.
ExitCode runProgram(int argc, const char* const* argv);

}  // namespace enfilade::server
