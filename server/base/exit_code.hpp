// How the program tells its caller what happened.
#pragma once

namespace enfilade::server {

enum class ExitCode : int {
  done = 0,
  runtimeError = 1,
  usage = 2,
  violations = 3,  ///< a check found some: an audit, or with --strict refused or blocked orders
  diverged = 4,    ///< a replay ended otherwise than it was recorded
  interrupted = 130
};

}  // namespace enfilade::server
