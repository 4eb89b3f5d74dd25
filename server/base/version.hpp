// Version of the server program.
#pragma once

#include <string>

namespace enfilade::server {

/// Semantic version of the program.
inline constexpr const char* kServerVersion = "0.1.0";

// Defined in a source that each build checks (cmake/write_build_info.cmake).
extern const char* const kGitCommit;  ///< ten digits; "unknown" outside of a git checkout
extern const char* const kBuildType;  ///< for example Release

/// For example "enfilade 0.1.0 (commit 1a2b3c4d5e, Release)".
inline std::string formatVersion() {
  return std::string("enfilade ") + kServerVersion + " (commit " + kGitCommit + ", " + kBuildType +
         ")";
}

}  // namespace enfilade::server
