#include "server/app/program.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <cstdio>
#include <memory>

#include "server/app/command_line.hpp"
#include "server/log/rate_limited_sink.hpp"

namespace enfilade::server {
namespace {

struct CommandRunner {
  ExitCode operator()(const DoctorCommand& command) const { return doctor(command); }
  ExitCode operator()(const ServeCommand& command) const { return serve(command); }
  ExitCode operator()(const ReplayCommand& command) const { return replay(command); }
  ExitCode operator()(const VerifyCommand& command) const { return verify(command); }
  ExitCode operator()(const CaptureCommand& command) const { return capture(command); }
  ExitCode operator()(const WalkCommand& command) const { return walk(command); }
  ExitCode operator()(const DiffCommand& command) const { return diff(command); }
  ExitCode operator()(const ResimulateCommand& command) const { return resimulate(command); }
  ExitCode operator()(const ExportCommand& command) const { return exportRecording(command); }
  ExitCode operator()(const ExportSceneCommand& command) const { return exportScene(command); }
  ExitCode operator()(const ExportReplayCommand& command) const { return exportReplay(command); }
  ExitCode operator()(const RouteCommand& command) const { return route(command); }
  ExitCode operator()(const InspectCommand& command) const { return inspect(command); }
};

constexpr int kMaxLinesPerSecond = 200;  // of the log; a person reads far fewer

void logToStderr() {
  auto logger = spdlog::get("enfilade");
  if (!logger) {
    logger = std::make_shared<spdlog::logger>(
        "enfilade",
        std::make_shared<RateLimitedSink>(std::make_shared<spdlog::sinks::stderr_color_sink_mt>(),
                                          kMaxLinesPerSecond));
    spdlog::initialize_logger(logger);
  }
  logger->set_pattern("%H:%M:%S.%e %^%l%$ %v");
  spdlog::set_default_logger(std::move(logger));
}

}  // namespace

ExitCode runProgram(int argc, const char* const* argv) {
  logToStderr();
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond `ulimit -f` then fails with an error
  const auto command = readCommandLine(argc, argv);
  if (const auto* code = std::get_if<ExitCode>(&command)) return *code;
  try {
    return std::visit(CommandRunner{}, std::get<ProgramCommand>(command));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "enfilade: %s\n", error.what());
    return ExitCode::runtimeError;
  }
}

}  // namespace enfilade::server
