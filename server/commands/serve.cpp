#include "server/commands/serve.hpp"

#include <poll.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "protocol/recording/seekable_recording.hpp"
#include "server/base/load_scene.hpp"
#include "server/base/standard_output.hpp"
#include "server/messages/world_messages.hpp"
#include "server/net/server.hpp"
#include "server/recording/world_from_recording.hpp"
#include "server/recording/world_recorder.hpp"

namespace enfilade::server {
namespace {

void tellReady(const Server& server, const scene::Scene& scene, const ServeCommand& command) {
  char hash[17];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(scene.hash()));
  nlohmann::ordered_json ready{
      {"ready", true},
      {"port", server.port()},
      {"address", command.listen.host},
      {"scene", std::filesystem::path(scene.model().source).filename().string()},
      {"scene_hash", hash},
      {"objects", scene.model().objects.size()},
      {"worlds", server.worldNames()}};
  if (!command.recording.empty()) ready["recording"] = command.recording.filename().string();
  const auto replace = nlohmann::ordered_json::error_handler_t::replace;
  writeToStdout(ready.dump(-1, ' ', false, replace) + "\n");
}

/// Signals that end the program wait until somebody asks for them.
sigset_t holdEndingSignals() {
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGINT);
  sigaddset(&ending, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);
  return ending;
}

/// Whether standard input is at its end. What comes before it is thrown away.
bool inputEnded() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (::poll(&input, 1, 0) <= 0) return false;
  char thrownAway[4096];
  return ::read(STDIN_FILENO, thrownAway, sizeof thrownAway) == 0;
}

/// The signal that came; SIGTERM also for the end of input, if that ends the server. Throws when
/// the server failed before.
int awaitEndingSignal(const sigset_t& ending, const Server& server, bool stopAtEndOfInput) {
  for (;;) {
    const timespec moment{0, 250'000'000};
    const int signal = sigtimedwait(&ending, nullptr, &moment);
    if (signal > 0) return signal;
    if (stopAtEndOfInput && inputEnded()) return SIGTERM;
    server.rethrowFailure();
  }
}

std::vector<std::shared_ptr<const scene::Scene>> loadFurther(const ServeCommand& command) {
  std::vector<std::shared_ptr<const scene::Scene>> scenes;
  ModelOptions model = command.model;
  for (const std::filesystem::path& file : command.furtherScenes) {
    model.file = file;
    scenes.push_back(loadScene(model));
  }
  return scenes;
}

/// The command as the recording that is to be played has it: the scene's file, how it is imported,
/// and the lengths.
ServeCommand asRecorded(const ServeCommand& asked) {
  ServeCommand command = asked;
  if (asked.recording.empty()) return command;
  const protocol::SeekableRecording recording(asked.recording, asked.run);
  command.model = recordedModel(recording.start(), asked.model.file, asked.model.cache);
  const auto lengths = lengthsFrom(recording.start().lengths());
  if (!lengths)
    throw protocol::mcap::RecordingError(asked.recording.string() +
                                         ": it has lengths that no world can have");
  command.lengths = *lengths;
  if (!command.from) command.from = recording.firstTick();
  return command;
}

WorldOptions worldOf(const ServeCommand& command) {
  WorldOptions world;
  world.lengths = command.lengths;
  world.auditEvery = command.auditEvery;
  if (!command.recording.empty()) world.replay = {command.recording, *command.from, command.run};
  if (command.record.file.empty()) return world;
  world.record = {command.record, command.model};
  world.record->replace = false;  // what clients did cannot be had again
  // A branch is not recorded before there is one: that is late to say so.
  if (world.replay && std::filesystem::exists(command.record.file))
    throw protocol::mcap::RecordingError(command.record.file.string() +
                                         ": is there already: move it away, or name another file");
  return world;
}

ExitCode serveUntilSignal(const ServeCommand& command) {
  Access access = command.access;
  if (!command.tokenFile.empty()) access.tokens = readTokens(command.tokenFile);
  const auto scene = loadScene(command.model);
  ServerOptions options;
  options.furtherScenes = loadFurther(command);
  // From here on: the threads that the server starts inherit the mask.
  const sigset_t ending = holdEndingSignals();
  options.world = worldOf(command);
  options.access = std::move(access);
  options.drawing = command.drawing;
  Server server(scene, command.listen, std::move(options));
  tellReady(server, *scene, command);
  const int signal = awaitEndingSignal(ending, server, command.stopAtEndOfInput);
  spdlog::info("{}: finishing the tick and telling the clients",
               signal == SIGINT ? "interrupted" : "told to stop");
  server.stop();
  const AuditTotals audit = server.auditTotals();
  if (command.auditEvery != 0) logTotals(audit);
  if (!server.recordedAll()) return ExitCode::runtimeError;
  if (signal == SIGINT) return ExitCode::interrupted;
  return audit.right() ? ExitCode::done : ExitCode::violations;
}

}  // namespace

ExitCode serve(const ServeCommand& command) {
  try {
    return serveUntilSignal(asRecorded(command));
  } catch (const Diverged& diverged) {
    std::fprintf(stderr, "enfilade: %s: it cannot be played: %s\n",
                 command.recording.string().c_str(), textOf(diverged).c_str());
    return ExitCode::diverged;
  }
}

}  // namespace enfilade::server
