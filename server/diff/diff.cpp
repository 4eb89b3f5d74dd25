#include "server/diff/diff.hpp"

#include "server/base/standard_output.hpp"
#include "server/diff/difference_json.hpp"
#include "server/diff/difference_text.hpp"

namespace enfilade::server {

ExitCode diff(const DiffCommand& command) {
  const WalkDifference difference = compareWalks(command.before, command.after, command.tolerance);
  const std::string text =
      command.json ? formatDifferenceJson(difference) + "\n" : formatDifferenceText(difference);
  writeToStdout(text);
  return difference.worse > 0 ? ExitCode::violations : ExitCode::success;
}

}  // namespace enfilade::server
