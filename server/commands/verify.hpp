// `enfilade replay --verify`: re-runs a recording and compares the state after every tick.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "server/base/exit_code.hpp"

namespace enfilade::server {

struct VerifyCommand {
  std::filesystem::path scene;  ///< empty: the scene that the recording names
  std::filesystem::path recording;
  bool cache = true;
  std::optional<std::uint64_t> from = {};  ///< start after this tick; nullopt: verify all
  std::optional<std::uint32_t> run = {};   ///< nullopt: all runs, or the first with `from`
};

/// Reports one JSON object on stdout. Returns `diverged` if a state differs.
ExitCode verify(const VerifyCommand& command);

}  // namespace enfilade::server
