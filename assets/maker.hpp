// The main function of make_building and make_feeder: their arguments, and errors as exit codes.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace enfilade::assets {

struct MakerArguments {
  std::string file;                   ///< the GLB file to write
  std::optional<std::size_t> number;  ///< of objects or parts
  std::optional<std::uint64_t> seed;
};

/// Parses `OUT [NUMBER [SEED]]` and calls `make`; `--help` alone prints `usage`. Returns the exit
/// code: 0; 1 if `make` throws; 2, with `usage` on stderr, if an argument is invalid, also where
/// `make` throws std::invalid_argument.
int runMaker(int argc, const char* const* argv, const char* usage,
             const std::function<void(const MakerArguments&)>& make);

}  // namespace enfilade::assets
