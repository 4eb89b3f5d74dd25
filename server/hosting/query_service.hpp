// Answers queries about a snapshot (rays, distances, touching, time to contact, navigation) on
// threads of its own, so that ticks do not wait. Acceleration structures are built at first use.
#pragma once

#include <functional>
#include <memory>
#include <variant>

#include "protocol/enfilade.pb.h"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"
#include "scene/world/data/world_settings.hpp"
#include "server/base/server_limits.hpp"
#include "server/messages/outgoing_queue.hpp"
#include "server/navigation/path_answer.hpp"

namespace enfilade::server {

/// A query with its snapshot, settings and limits.
struct SceneQuery {
  std::shared_ptr<const scene::Snapshot> snapshot;
  v1::ClientMessage message;  ///< a query about the scene at a tick
  scene::WorldSettings settings;
  ServerLimits limits;
  /// Of a navigation query: the share of the meshes that are built, 0..1, by it or by those before
  /// it. Called on the thread of navigation queries.
  std::function<void(double)> progress = {};
  std::shared_ptr<KeptPaths> keptPaths = {};  ///< of its world; may be null
};

class QueryService {
 public:
  explicit QueryService(std::shared_ptr<const scene::Scene> scene);
  ~QueryService();
  QueryService(const QueryService&) = delete;
  QueryService& operator=(const QueryService&) = delete;

  /// `done` receives the encoded reply or Error on a thread of the service. Navigation queries are
  /// answered in their order, all others in theirs.
  void submit(SceneQuery query, std::function<void(EncodedMessage)> done);
  /// Answers a path query without encoding the reply.
  void submitPath(SceneQuery query,
                  std::function<void(std::variant<v1::NavigationReply, v1::Error>)> done);
  /// Waits for all queries. Do not submit queries afterwards.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::server
