// A difference of two walks for people and for programs.
#pragma once

#include <string>

#include "server/diff/walk_difference.hpp"

namespace enfilade::server {

/// Lines for a terminal: metres with millimetres, times as m:ss, worst first, no more than some
/// dozens a heading, and how many more there are.
std::string differenceText(const WalkDifference& difference);

/// One JSON object, indented, with everything (RECORDING.md tells its keys).
std::string differenceJson(const WalkDifference& difference);

/// One change in one line, as the text has it.
std::string lineOf(const HappeningChange& change);
std::string lineOf(const OrderChange& change);
std::string lineOf(const ClearanceChange& change);

}  // namespace enfilade::server
