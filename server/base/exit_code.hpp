// Exit codes of the program; docs/exit_codes.md lists them by command.
#pragma once

namespace enfilade::server {

enum class ExitCode : int {
  success = 0,
  runtimeError = 1,  ///< a file, a device, a connection or stdout failed
  usageError = 2,    ///< the command line is wrong
  violations = 3,    ///< audit findings, regressions, and with --strict failed orders or problems
  diverged = 4,      ///< a replay differs from its recording
  interrupted = 130  ///< stopped by SIGINT or SIGTERM
};

}  // namespace enfilade::server
