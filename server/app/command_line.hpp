// The command line of the program, parsed into plain data.
#pragma once

#include <variant>

#include "server/base/exit_code.hpp"
#include "server/capture/capture.hpp"
#include "server/commands/doctor.hpp"
#include "server/commands/export.hpp"
#include "server/commands/export_replay.hpp"
#include "server/commands/export_scene.hpp"
#include "server/commands/route.hpp"
#include "server/commands/serve.hpp"
#include "server/commands/verify.hpp"
#include "server/diff/diff.hpp"
#include "server/diff/resimulate.hpp"
#include "server/inspection/inspect.hpp"
#include "server/runs/reported_run.hpp"

namespace enfilade::server {

using ProgramCommand =
    std::variant<DoctorCommand, ServeCommand, ReplayCommand, VerifyCommand, CaptureCommand,
                 WalkCommand, InspectCommand, DiffCommand, ResimulateCommand, ExportCommand,
                 ExportSceneCommand, ExportReplayCommand, RouteCommand>;

/// Returns the command, or the exit code (--help: done; an error: usage). Help goes to stdout,
/// errors go to stderr.
std::variant<ProgramCommand, ExitCode> readCommandLine(int argc, const char* const* argv);

}  // namespace enfilade::server
