# Writes OUTPUT, a source with the git commit of SOURCE and the BUILD_TYPE. The build runs this
# script each time; the file is written, and compiled, only if its content changed.

set(commit "unknown")
if(EXISTS ${SOURCE}/.git)  # an exported tree inside another repository has no commit of its own
  execute_process(COMMAND git rev-parse --short=10 HEAD WORKING_DIRECTORY ${SOURCE}
                  OUTPUT_VARIABLE head OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET
                  RESULT_VARIABLE failed)
  if(NOT failed)
    set(commit ${head})
    execute_process(COMMAND git diff-index --quiet HEAD WORKING_DIRECTORY ${SOURCE}
                    ERROR_QUIET RESULT_VARIABLE changed)
    if(changed)
      string(APPEND commit "-dirty")
    endif()
  endif()
endif()
if(NOT BUILD_TYPE)
  set(BUILD_TYPE "no build type")
endif()

file(CONFIGURE OUTPUT ${OUTPUT} CONTENT [[
#include "server/base/version.hpp"

namespace enfilade::server {

const char* const kGitCommit = "@commit@";
const char* const kBuildType = "@BUILD_TYPE@";

}  // namespace enfilade::server
]] @ONLY)
