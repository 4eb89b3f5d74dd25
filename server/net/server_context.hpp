// What all connections share: whom they speak to, what they may do, and who they are. On the
// network thread alone.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/base/access.hpp"
#include "server/hosting/world_registry.hpp"

namespace enfilade::server {

/// Anything that holds a socket of a client.
class Connection {
 public:
  virtual ~Connection() = default;
  /// Tells the reason, where that is possible, and closes.
  virtual void end(v1::ErrorCode code, const std::string& reason) = 0;
  /// Closes at once if nobody knows yet who this is; false when it stays.
  virtual bool giveWay() = 0;
};

struct Reception {
  Worlds& worlds;
  const ServerLimits limits;
  const Access access;
  std::vector<std::weak_ptr<Connection>> connections;
  bool closed = false;  ///< who still comes is sent away
};

/// The reception will end the connection when the server ends.
inline void enlist(Reception& reception, const std::shared_ptr<Connection>& connection) {
  std::erase_if(reception.connections, [](const auto& one) { return one.expired(); });
  reception.connections.push_back(connection);
  if (reception.closed) connection->end(v1::ERROR_SHUTTING_DOWN, "the server ends");
}

}  // namespace enfilade::server
