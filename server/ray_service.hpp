// Answers to rays, on a thread of their own, so that the tick never waits for them. The tree over
// the scene is built when somebody first asks.
#pragma once

#include <functional>
#include <memory>

#include "scene/scene.hpp"
#include "scene/snapshot.hpp"
#include "server/outgoing_queue.hpp"
#include "server/ray_messages.hpp"

namespace enfilade::server {

struct RayJob {
  std::shared_ptr<const scene::Snapshot> snapshot;
  AskedRays asked;
  std::uint64_t requestId = 0;
};

class RayService {
 public:
  explicit RayService(std::shared_ptr<const scene::Scene> scene);
  ~RayService();
  RayService(const RayService&) = delete;
  RayService& operator=(const RayService&) = delete;

  /// `done` gets the whole reply (a RayReply or an Error) on the service's thread, in the order of
  /// the calls.
  void cast(RayJob job, std::function<void(Buffer)> done);
  /// Waits for what was asked; nothing may be asked afterwards.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::server
