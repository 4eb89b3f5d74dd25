// Answers to questions about a scene at a tick (rays, distances, what touches what), on a thread of
// their own, so that the tick never waits for them. What they are answered with is built when
// somebody first asks.
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

struct Question {
  std::shared_ptr<const scene::Snapshot> snapshot;
  v1::ClientMessage message;  ///< a RayQuery, DistanceQuery, TouchingQuery or CannotTouchQuery
  scene::Lengths lengths;
  ServerLimits limits;
};

class QuestionService {
 public:
  explicit QuestionService(std::shared_ptr<const scene::Scene> scene);
  ~QuestionService();
  QuestionService(const QuestionService&) = delete;
  QuestionService& operator=(const QuestionService&) = delete;

  /// `done` gets the whole reply (or an Error) on the service's thread, in the order of the calls.
  void ask(Question question, std::function<void(Encoded)> done);
  /// Waits for what was asked; nothing may be asked afterwards.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::server
