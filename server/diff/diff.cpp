#include "server/diff/diff.hpp"

#include "server/base/standard_output.hpp"
#include "server/diff/difference_report.hpp"

namespace enfilade::server {

ExitCode diff(const DiffCommand& command) {
  const WalkDifference difference = compareWalks(command.before, command.after, command.tolerance);
  const std::string text =
      command.json ? differenceJson(difference) + "\n" : differenceText(difference);
  writeToStdout(text);
  return difference.worse > 0 ? ExitCode::violations : ExitCode::done;
}

}  // namespace enfilade::server
