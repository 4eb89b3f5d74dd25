// `enfilade diff`: reports the changes between two recorded walks.
#pragma once

#include <filesystem>

#include "server/base/exit_code.hpp"

namespace enfilade::server {

struct DiffCommand {
  std::filesystem::path before, after;
  double tolerance = 0.001;  ///< metres; smaller differences are ignored
  bool json = false;
};

/// Returns `violations` if something got worse. Throws protocol::mcap::RecordingError.
ExitCode diff(const DiffCommand& command);

}  // namespace enfilade::server
