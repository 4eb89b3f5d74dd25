// Report of a walk difference as text for a terminal.
#pragma once

#include <string>

#include "server/diff/walk_difference.hpp"

namespace enfilade::server {

/// Metres with millimetres, times as m:ss, worst first. Each section is limited and ends with the
/// number of omitted lines.
std::string formatDifferenceText(const WalkDifference& difference);

/// One change in one line of the report.
std::string formatLine(const WalkEventChange& change);
std::string formatLine(const OrderChange& change);
std::string formatLine(const ClearanceChange& change);

}  // namespace enfilade::server
