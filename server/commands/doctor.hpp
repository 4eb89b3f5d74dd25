// `enfilade doctor`: tests the graphics devices of this machine.
#pragma once

#include <filesystem>

#include "server/base/exit_code.hpp"

namespace enfilade::server {

struct DoctorCommand {
  bool json = false;
  bool requireGpu = false;    ///< fail if only a CPU can draw
  std::filesystem::path out;  ///< file of the self-test picture; empty: none
};

/// Renders a self-test picture on each EGL device and reports on stdout. Returns `runtimeError` if
/// no device renders it correctly.
ExitCode doctor(const DoctorCommand& command);

}  // namespace enfilade::server
