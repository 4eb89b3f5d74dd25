// Scenes served to clients over TCP, WebSocket and HTTP.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "server/app/command_line.hpp"
#include "server/base/access.hpp"
#include "server/base/audit_log.hpp"
#include "server/hosting/world_options.hpp"

namespace enfilade::server {

/// Names the address and the remedy.
struct ServerError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct ServerOptions {
  /// Each has a world, as the first one has "main"; clients may make more of all of them.
  std::vector<std::shared_ptr<const scene::Scene>> furtherScenes;
  WorldOptions world;
  Access access;
  DrawingOptions drawing;
};

class Server {
 public:
  /// Clients may connect when this returns. Throws ServerError: the address cannot be had, or
  /// others can reach it and `access` does not allow that; RenderError: as FrameService;
  /// RecordingError: the recording cannot be begun.
  Server(std::shared_ptr<const scene::Scene> scene, const Endpoint& listen,
         ServerOptions options = {});
  ~Server();  ///< stops
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;
  const std::string& rendererName()
      const;  ///< "" without a renderer; waits until it is made. Not after stop()
  /// Of all worlds, "main" first.
  std::vector<std::string> worldNames() const;
  /// Throws what ended the main world, if anything did: a fault of ours. Others end alone.
  void rethrowFailure() const;
  /// Finishes the tick, ends the contacts, tells the clients, and closes.
  void stop();
  /// Of all ticks that were audited; only after stop().
  AuditTotals auditTotals() const;
  /// Whether what was to be recorded is; only after stop().
  bool recordedAll() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::server
