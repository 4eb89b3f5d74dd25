// Writes a command's result to stdout and reports failures: a full disk, a closed pipe.
#pragma once

#include <string>

namespace enfilade::server {

/// Writes all of `text` and flushes. Throws std::runtime_error if that fails; the message ends with
/// `fallbackNote`, which names another place of the result ("" if there is no other place).
void writeToStdout(const std::string& text, const std::string& fallbackNote = "");

}  // namespace enfilade::server
