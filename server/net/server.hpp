// The server: hosts scenes for clients over TCP, WebSocket and HTTP.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "server/base/access.hpp"
#include "server/base/audit_log.hpp"
#include "server/base/drawing_options.hpp"
#include "server/base/host_port.hpp"
#include "server/hosting/world_options.hpp"

namespace enfilade::server {

struct ServerOptions {
  /// Each gets a world, in addition to "main" of the first scene; clients may create more.
  std::vector<std::shared_ptr<const scene::Scene>> additionalScenes;
  WorldOptions world;
  Access access;
  DrawingOptions drawing;
  /// Of the web page at "/"; see findPageFolder(). Empty: no page.
  std::filesystem::path pageFolder = {};
};

/// Throws ServerError if a server would not listen on the address: it is no numeric one, or
/// reachable from other machines without permission in `access`.
void requireListenable(const HostPort& listen, const Access& access);

class Server {
 public:
  /// Clients may connect after construction. Throws ServerError if the address is unavailable, or
  /// reachable from other machines without permission in `access`. Throws RenderError, like
  /// FrameService, and RecordingError if the recording cannot be started.
  Server(std::shared_ptr<const scene::Scene> scene, const HostPort& listen,
         ServerOptions options = {});
  ~Server();  ///< calls stop()
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;
  /// "" without a renderer; waits until it is created. Not after stop().
  const std::string& rendererName() const;
  /// Names of all worlds, "main" first.
  std::vector<std::string> worldNames() const;
  /// Rethrows the internal error that ended the main world, if any. Errors of other worlds end only
  /// these worlds.
  void rethrowFailure() const;
  /// Finishes the tick, ends the contacts, notifies the clients, and closes.
  void stop();
  /// Totals of all audited ticks; only after stop().
  AuditTotals auditTotals() const;
  /// Whether all recordings are complete; only after stop().
  bool isRecordingComplete() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::server
