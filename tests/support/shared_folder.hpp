// Locates the folder of the real scenes that are too large for the repository.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>

namespace enfilade::tests {

/// $ENFILADE_SHARED, otherwise `shared` next to the source folder; nullopt if absent. A test that
/// needs it is then skipped, or fails if the environment variable CI is set.
inline std::optional<std::filesystem::path> findSharedFolder() {
  namespace fs = std::filesystem;
  if (const char* named = std::getenv("ENFILADE_SHARED"); named != nullptr) {
    return fs::is_directory(named) ? std::optional<fs::path>(named) : std::nullopt;
  }
  const fs::path sources = fs::absolute(__FILE__).parent_path().parent_path().parent_path();
  const fs::path shared = sources.parent_path() / "shared";
  return fs::is_directory(shared) ? std::optional(shared) : std::nullopt;
}

}  // namespace enfilade::tests

/// Ends the test if the folder is missing: as skipped, or in CI as failed.
#define ENFILADE_NEED_SHARED(folder)                                                            \
  const auto folder = enfilade::tests::findSharedFolder();                                      \
  if (!folder) {                                                                                \
    const char* reason = "no shared folder: set ENFILADE_SHARED or put it next to the sources"; \
    if (std::getenv("CI") != nullptr) FAIL() << reason;                                         \
    GTEST_SKIP() << reason;                                                                     \
  }
