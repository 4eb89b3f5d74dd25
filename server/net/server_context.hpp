// State shared by all connections: worlds, limits, access, and the list of connections. Network
// thread only.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/base/access.hpp"
#include "server/base/server_limits.hpp"
#include "server/messages/outgoing_queue.hpp"
#include "server/net/page_files.hpp"
#include "server/worlds/world_registry.hpp"

namespace enfilade::server {

inline constexpr const char* kServerIsFull =
    "the server has reached its connection limit: try again later";

/// A connection of a client, in any protocol.
class ClientConnection {
 public:
  virtual ~ClientConnection() = default;
  /// Sends the reason, if the protocol allows it, and closes.
  virtual void end(v1::ErrorCode code, const std::string& reason) = 0;
  /// Closes immediately if the client has not identified itself; returns whether it closed.
  virtual bool evictIfAnonymous() = 0;
};

struct ServerContext {
  WorldRegistry& worlds;
  const ServerLimits limits;
  const Access access;
  const PageFiles page;
  const std::shared_ptr<OutgoingBudget> outgoing;
  std::vector<std::weak_ptr<ClientConnection>> connections = {};
  std::size_t streams = 0;  ///< of MJPEG
  bool closed = false;      ///< new connections are rejected
};

inline OutgoingLimits makeOutgoingLimits(const ServerContext& context) {
  const ServerLimits& limits = context.limits;
  return {limits.outgoingBytes, limits.outgoingFrames, limits.outgoingFrameBytes, context.outgoing};
}

/// Registers a connection, so that it is ended when the server stops.
inline void registerConnection(ServerContext& context,
                               const std::shared_ptr<ClientConnection>& connection) {
  std::erase_if(context.connections, [](const auto& one) { return one.expired(); });
  context.connections.push_back(connection);
  if (context.closed) connection->end(v1::ERROR_SHUTTING_DOWN, "the server is stopping");
}

}  // namespace enfilade::server
