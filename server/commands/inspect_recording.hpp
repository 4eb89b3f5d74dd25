// `enfilade inspect` of a recording: what is in it, and how far it can be read.
#pragma once

#include <filesystem>

#include "server/base/exit_code.hpp"

namespace enfilade::server {

/// Tells it on stdout. `runtimeError` when it is spoilt; with `strict`, `violations` when its
/// writer did not get to its end. Throws protocol::mcap::RecordingError when nothing of it can be
/// read.
ExitCode inspectRecording(const std::filesystem::path& file, bool json, bool strict);

}  // namespace enfilade::server
