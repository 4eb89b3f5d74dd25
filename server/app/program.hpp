// The program, without its main: so that it can be tried by tests.
#pragma once

#include "server/base/exit_code.hpp"

namespace enfilade::server {

/// Reads the command line and does what it says. Errors are told on stderr.
ExitCode runProgram(int argc, const char* const* argv);

}  // namespace enfilade::server
