// Report of a walk difference as JSON.
#pragma once

#include <string>

#include "server/diff/walk_difference.hpp"

namespace enfilade::server {

/// One indented JSON object with all changes (keys: RECORDING.md).
std::string formatDifferenceJson(const WalkDifference& difference);

}  // namespace enfilade::server
