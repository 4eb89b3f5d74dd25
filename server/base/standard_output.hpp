// What a command answers on stdout, told when stdout does not take it: a full disk, a closed pipe.
#pragma once

#include <string>

namespace enfilade::server {

/// Writes all of `text` and flushes. Throws std::runtime_error when stdout does not take it;
/// `kept` says where the answer stands all the same ("" when nowhere).
void writeToStdout(const std::string& text, const std::string& kept = "");

}  // namespace enfilade::server
