#include "server/serve.hpp"

#include <poll.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "server/load_scene.hpp"
#include "server/server.hpp"
#include "server/world_messages.hpp"

namespace enfilade::server {
namespace {

void tellReady(const Server& server, const scene::Scene& scene, const Endpoint& listen) {
  char hash[17];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(scene.hash()));
  const nlohmann::ordered_json ready{{"ready", true},
                                     {"port", server.port()},
                                     {"address", listen.host},
                                     {"scene", messageOf(scene).source()},
                                     {"scene_hash", hash},
                                     {"objects", scene.model().objects.size()},
                                     {"renderer", server.rendererName()},
                                     {"worlds", server.worldNames()}};
  const auto replace = nlohmann::ordered_json::error_handler_t::replace;
  std::printf("%s\n", ready.dump(-1, ' ', false, replace).c_str());
  std::fflush(stdout);
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

}  // namespace

ExitCode serve(const ServeCommand& command) {
  Access access = command.access;
  if (!command.tokenFile.empty()) access.tokens = readTokens(command.tokenFile);
  const auto scene = loadScene(command.model);
  ServerOptions options;
  options.furtherScenes = loadFurther(command);
  // From here on: the threads that the server starts inherit the mask.
  const sigset_t ending = holdEndingSignals();
  options.world.lengths = command.lengths;
  options.world.auditEvery = command.auditEvery;
  options.access = std::move(access);
  options.drawing = command.drawing;
  if (!command.record.file.empty()) {
    options.world.record = {command.record, command.model};
    options.world.record->replace = false;  // what clients did cannot be had again
  }
  Server server(scene, command.listen, std::move(options));
  tellReady(server, *scene, command.listen);
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

}  // namespace enfilade::server
