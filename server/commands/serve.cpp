#include "server/commands/serve.hpp"

#include <malloc.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <ctime>
#include <nlohmann/json.hpp>

#include "protocol/recording/seekable_recording.hpp"
#include "server/base/load_scene.hpp"
#include "server/base/standard_output.hpp"
#include "server/log/log.hpp"
#include "server/messages/world_messages.hpp"
#include "server/net/page_files.hpp"
#include "server/net/server.hpp"
#include "server/recording/world_from_recording.hpp"
#include "server/recording/world_recorder.hpp"

namespace enfilade::server {
namespace {

constexpr int kTopPad = 128 << 10;  // bytes; the default of glibc

void printReady(const Server& server, const scene::Scene& scene, const ServeCommand& command) {
  nlohmann::ordered_json ready{
      {"ready", true},
      {"port", server.port()},
      {"address", command.listen.host},
      {"scene", std::filesystem::path(scene.model().source).filename().string()},
      {"scene_hash", protocol::toHex(scene.hash())},
      {"objects", scene.model().objects.size()},
      {"worlds", server.worldNames()}};
  if (!command.recording.empty()) ready["recording"] = command.recording.filename().string();
  const auto replace = nlohmann::ordered_json::error_handler_t::replace;
  writeToStdout(ready.dump(-1, ' ', false, replace) + "\n");
}

/// Blocks the signals that end the program, until awaitEndingSignal() handles them.
sigset_t blockEndingSignals() {
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGINT);
  sigaddset(&ending, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);
  return ending;
}

/// True if standard input is at its end. Input before that is discarded.
bool isInputClosed() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (::poll(&input, 1, 0) <= 0) return false;
  char discarded[4096];
  return ::read(STDIN_FILENO, discarded, sizeof discarded) == 0;
}

/// Waits for a signal and returns it; SIGTERM also for the end of input, if that stops the server.
/// Throws if the server failed before.
int awaitEndingSignal(const sigset_t& ending, const Server& server, bool stopAtEndOfInput) {
  for (;;) {
    const timespec pollInterval{0, 250'000'000};
    const int signal = sigtimedwait(&ending, nullptr, &pollInterval);
    if (signal > 0) return signal;
    if (stopAtEndOfInput && isInputClosed()) return SIGTERM;
    server.rethrowFailure();
  }
}

std::vector<std::shared_ptr<const scene::Scene>> loadFurtherScenes(const ServeCommand& command) {
  std::vector<std::shared_ptr<const scene::Scene>> scenes;
  ModelOptions model = command.model;
  for (const std::filesystem::path& file : command.furtherScenes) {
    model.file = file;
    scenes.push_back(loadScene(model));
  }
  return scenes;
}

/// Returns the command with the values of the played recording: scene file, import options and
/// settings.
ServeCommand applyRecording(const ServeCommand& requested) {
  ServeCommand command = requested;
  if (requested.recording.empty()) return command;
  const protocol::SeekableRecording recording(requested.recording, requested.run);
  command.model =
      makeRecordedModelOptions(recording.start(), requested.model.file, requested.model.cache);
  const auto settings = settingsFromProto(recording.start().lengths());
  if (!settings)
    throw protocol::mcap::RecordingError(requested.recording.string() +
                                         ": it has invalid world settings");
  command.settings = *settings;
  if (!command.from) command.from = recording.firstTick();
  return command;
}

WorldOptions makeWorldOptions(const ServeCommand& command) {
  WorldOptions world;
  world.settings = command.settings;
  world.auditEvery = command.auditEvery;
  if (!command.recording.empty()) world.replay = {command.recording, *command.from, command.run};
  if (command.record.file.empty()) return world;
  world.record = {command.record, command.model};
  world.record->overwrite = false;  // the actions of clients cannot be reproduced
  // The file of a branch is created only with the branch, which is too late for this error.
  if (world.replay && std::filesystem::exists(command.record.file))
    throw protocol::mcap::RecordingError(command.record.file.string() +
                                         ": exists already: move it, or give another file name");
  return world;
}

ExitCode serveUntilSignal(const ServeCommand& command) {
  Access access = command.access;
  if (!command.tokenFile.empty()) access.tokens = readTokens(command.tokenFile);
  requireListenable(command.listen, access);  // before the model is read
  // The heap grows in small steps otherwise, and each waits while another thread fetches memory: a
  // scene of a million objects takes a thousand.
  mallopt(M_TOP_PAD, 16 << 20);
  const auto scene = loadScene(command.model);
  ServerOptions options;
  options.additionalScenes = loadFurtherScenes(command);
  mallopt(M_TOP_PAD, kTopPad);
  // Before the server starts: its threads inherit the signal mask.
  const sigset_t ending = blockEndingSignals();
  options.world = makeWorldOptions(command);
  options.access = std::move(access);
  options.drawing = command.drawing;
  options.pageFolder = findPageFolder();
  Server server(scene, command.listen, std::move(options));
  printReady(server, *scene, command);
  const int signal = awaitEndingSignal(ending, server, command.stopAtEndOfInput);
  logInfo("{}: finishing the tick and notifying the clients",
          signal == SIGINT ? "interrupted" : "stopped");
  server.stop();
  const AuditTotals audit = server.auditTotals();
  if (command.auditEvery != 0) logTotals(audit);
  if (!server.isRecordingComplete()) return ExitCode::runtimeError;
  if (signal == SIGINT) return ExitCode::interrupted;
  return audit.isClean() ? ExitCode::success : ExitCode::violations;
}

}  // namespace

ExitCode serve(const ServeCommand& command) {
  // Without it glibc raises the threshold up to 32 MiB as blocks are freed. It then keeps the
  // memory of large pictures and messages of clients that left.
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
  try {
    return serveUntilSignal(applyRecording(command));
  } catch (const Divergence& diverged) {
    std::fprintf(stderr, "enfilade: %s: it cannot be played: %s\n",
                 command.recording.string().c_str(), formatDivergence(diverged).c_str());
    return ExitCode::diverged;
  }
}

}  // namespace enfilade::server
