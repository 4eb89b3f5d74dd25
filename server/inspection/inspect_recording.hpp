// `enfilade inspect` for recordings: contents, and the readable part of a damaged file.
#pragma once

#include <filesystem>

#include "server/base/exit_code.hpp"

namespace enfilade::server {

/// Reports on stdout. Returns `runtimeError` if the file is damaged and, with `strict`,
/// `violations` if its writer did not close it. Throws protocol::mcap::RecordingError if no part
/// is readable.
ExitCode inspectRecording(const std::filesystem::path& file, bool json, bool strict);

}  // namespace enfilade::server
