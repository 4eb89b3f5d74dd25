// Answers queries about a snapshot (rays, distances, touching, time to contact) on a thread of its
// own, so that ticks do not wait. Acceleration structures are built at first use.
#pragma once

#include <functional>
#include <memory>

#include "protocol/enfilade.pb.h"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"
#include "scene/world/data/world_settings.hpp"
#include "server/base/server_limits.hpp"
#include "server/messages/outgoing_queue.hpp"

namespace enfilade::server {

/// A query with its snapshot, settings and limits.
struct SceneQuery {
  std::shared_ptr<const scene::Snapshot> snapshot;
  v1::ClientMessage message;  ///< a RayQuery, DistanceQuery, TouchingQuery or CannotTouchQuery
  scene::WorldSettings settings;
  ServerLimits limits;
};

class QueryService {
 public:
  explicit QueryService(std::shared_ptr<const scene::Scene> scene);
  ~QueryService();
  QueryService(const QueryService&) = delete;
  QueryService& operator=(const QueryService&) = delete;

  /// `done` receives the encoded reply or Error on the service's thread, in the order of the calls.
  void submit(SceneQuery query, std::function<void(EncodedMessage)> done);
  /// Waits for all queries. Do not submit queries afterwards.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::server
