#include "server/base/standard_output.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>

namespace enfilade::server {

void writeToStdout(const std::string& text, const std::string& fallbackNote) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (written && std::fflush(stdout) == 0) return;
  throw std::runtime_error(std::string("cannot write to stdout: ") + std::strerror(errno) +
                           (fallbackNote.empty() ? "" : "; " + fallbackNote));
}

}  // namespace enfilade::server
