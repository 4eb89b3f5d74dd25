#include "server/diff/diff.hpp"

#include <cstdio>
#include <stdexcept>

#include "server/diff/difference_report.hpp"

namespace enfilade::server {

ExitCode diff(const DiffCommand& command) {
  const WalkDifference difference = compareWalks(command.before, command.after, command.tolerance);
  const std::string text =
      command.json ? differenceJson(difference) + "\n" : differenceText(difference);
  if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0)
    throw std::runtime_error("stdout cannot be written");
  return difference.worse > 0 ? ExitCode::violations : ExitCode::done;
}

}  // namespace enfilade::server
