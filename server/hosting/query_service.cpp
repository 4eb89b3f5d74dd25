#include "server/hosting/query_service.hpp"

#include <chrono>
#include <list>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "collision/assert.hpp"
#include "server/base/work_thread.hpp"
#include "server/floors/plan_messages.hpp"
#include "server/log/log.hpp"
#include "server/messages/proximity_messages.hpp"
#include "server/messages/ray_messages.hpp"
#include "server/messages/world_messages.hpp"
#include "server/navigation/navigation_service.hpp"

namespace enfilade::server {

struct QueryService::State {
  explicit State(std::shared_ptr<const scene::Scene> s)
      : scene(std::move(s)), navigation(scene), floorPlans(makeFloorPlanSource(scene)) {}

  std::shared_ptr<const scene::Scene> scene;
  std::optional<scene::RayCaster> caster;                 ///< built at the first ray query
  std::shared_ptr<const scene::Snapshot> casterSnapshot;  ///< state of the caster's moving entities
  std::optional<scene::EntityIndex> index;                ///< built at the first proximity query
  NavigationService navigation;  ///< used by its thread alone, as the next one
  FloorPlanSource floorPlans;
  std::mutex pendingMutex;
  /// Unanswered queries of the navigation thread. Waiting queries also receive mesh progress.
  std::list<std::shared_ptr<const SceneQuery>> pending;
  WorkThread thread, navigationThread;  // last members: they use the others

  const scene::RayCaster& updateCaster(const std::shared_ptr<const scene::Snapshot>& snapshot);
  scene::SceneAt makeSceneAt(const SceneQuery& query);
  std::variant<v1::RayReply, v1::Error> answerRays(const SceneQuery& query,
                                                   std::vector<std::uint8_t>& attachment);
  std::variant<v1::FloorPlan, v1::Error> answerPlan(const SceneQuery& query);
  std::variant<v1::NavigationReply, v1::Error> answerNavigation(
      const SceneQuery& query, std::vector<std::uint8_t>& attachment);
  void postNavigation(const std::shared_ptr<const SceneQuery>& query, std::function<void()> answer);
  EncodedMessage answerQuery(const SceneQuery& query);
  EncodedMessage answerSafely(const SceneQuery& query);
};

const scene::RayCaster& QueryService::State::updateCaster(
    const std::shared_ptr<const scene::Snapshot>& snapshot) {
  if (!caster) {
    const auto start = std::chrono::steady_clock::now();
    caster.emplace(scene);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    logInfo("rays: built the scene's BVH in {:.2f} s", seconds.count());
  }
  if (casterSnapshot != snapshot) {
    casterSnapshot.reset();  // invalid while the caster updates
    caster->update(*snapshot);
    casterSnapshot = snapshot;
  }
  return *caster;
}

scene::SceneAt QueryService::State::makeSceneAt(const SceneQuery& query) {
  if (!index) index.emplace(scene);
  return {*index, *query.snapshot};
}

std::variant<v1::RayReply, v1::Error> QueryService::State::answerRays(
    const SceneQuery& query, std::vector<std::uint8_t>& attachment) {
  auto resolved = rayQueryFromProto(query.message.rays(), *query.snapshot, query.limits);
  if (auto* error = std::get_if<v1::Error>(&resolved)) return std::move(*error);
  return castRays(std::get<ResolvedRayQuery>(resolved), updateCaster(query.snapshot), *scene,
                  *query.snapshot, attachment);
}

std::variant<v1::FloorPlan, v1::Error> QueryService::State::answerPlan(const SceneQuery& query) {
  return answerFloorPlan(query.message.floor_plan(), floorPlans, query.limits);
}

std::variant<v1::NavigationReply, v1::Error> QueryService::State::answerNavigation(
    const SceneQuery& query, std::vector<std::uint8_t>& attachment) {
  const auto report = [this](double share) {
    const std::lock_guard lock(pendingMutex);
    for (const auto& one : pending)
      if (one->progress) one->progress(share);
  };
  return navigation.answer(query.message.navigation(),
                           {query.snapshot, query.settings, report, query.keptPaths}, attachment);
}

void QueryService::State::postNavigation(const std::shared_ptr<const SceneQuery>& query,
                                         std::function<void()> answer) {
  {
    const std::lock_guard lock(pendingMutex);
    pending.push_back(query);
  }
  navigationThread.post([this, query, answer = std::move(answer)] {
    answer();
    const std::lock_guard lock(pendingMutex);
    std::erase(pending, query);
  });
}

namespace {

/// Stores the answer in `field` of the message, or the error.
template <class Answer>
void setReply(v1::ServerMessage& message, std::variant<Answer, v1::Error> answer,
              Answer* (v1::ServerMessage::*field)()) {
  if (auto* error = std::get_if<v1::Error>(&answer))
    *message.mutable_error() = std::move(*error);
  else
    *(message.*field)() = std::get<Answer>(std::move(answer));
}

}  // namespace

EncodedMessage QueryService::State::answerQuery(const SceneQuery& query) {
  const v1::ClientMessage& message = query.message;
  std::vector<std::uint8_t> attachment;
  v1::ServerMessage reply;
  reply.set_reply_to(message.request_id());
  switch (message.body_case()) {
    case v1::ClientMessage::kRays:
      setReply(reply, answerRays(query, attachment), &v1::ServerMessage::mutable_rays);
      break;
    case v1::ClientMessage::kDistances:
      setReply(reply, answerDistances(message.distances(), makeSceneAt(query), query.limits),
               &v1::ServerMessage::mutable_distances);
      break;
    case v1::ClientMessage::kTouching:
      setReply(reply,
               answerTouching(message.touching(), makeSceneAt(query), query.settings, query.limits),
               &v1::ServerMessage::mutable_touching);
      break;
    case v1::ClientMessage::kFloorPlan:
      setReply(reply, answerPlan(query), &v1::ServerMessage::mutable_floor_plan);
      break;
    case v1::ClientMessage::kNavigation:
      setReply(reply, answerNavigation(query, attachment), &v1::ServerMessage::mutable_navigation);
      break;
    case v1::ClientMessage::kCannotTouch:
      setReply(reply, answerCannotTouch(message.cannot_touch(), makeSceneAt(query), query.settings),
               &v1::ServerMessage::mutable_cannot_touch);
      break;
    default:
      throw std::logic_error("the query thread has no answer to this request");
  }
  return encodeShared(reply, std::move(attachment));
}

EncodedMessage QueryService::State::answerSafely(const SceneQuery& query) {
  try {
    return answerQuery(query);
  } catch (const std::exception& error) {
    logError("a query failed: {}", error.what());
    return makeErrorReply(query.message.request_id(), makeError(v1::ERROR_INTERNAL, error.what()));
  }
}

QueryService::QueryService(std::shared_ptr<const scene::Scene> scene)
    : state_(std::make_unique<State>(std::move(scene))) {}

QueryService::~QueryService() {
  finish();
}

void QueryService::submit(SceneQuery query, std::function<void(EncodedMessage)> done) {
  ENFILADE_ASSERT(query.message.has_rays() || query.message.has_distances() ||
                  query.message.has_touching() || query.message.has_cannot_touch() ||
                  query.message.has_floor_plan() || query.message.has_navigation());
  const auto shared = std::make_shared<const SceneQuery>(std::move(query));
  auto answer = [state = state_.get(), shared, done = std::move(done)] {
    done(state->answerSafely(*shared));
  };
  // Plans of a large scene take as long as paths: rays do not wait for them.
  if (shared->message.has_navigation() || shared->message.has_floor_plan())
    state_->postNavigation(shared, std::move(answer));
  else
    state_->thread.post(std::move(answer));
}

void QueryService::submitPath(
    SceneQuery query, std::function<void(std::variant<v1::NavigationReply, v1::Error>)> done) {
  ENFILADE_ASSERT(query.message.has_navigation());
  const auto shared = std::make_shared<const SceneQuery>(std::move(query));
  state_->postNavigation(shared, [state = state_.get(), shared, done = std::move(done)] {
    std::vector<std::uint8_t> attachment;
    try {
      done(state->answerNavigation(*shared, attachment));
    } catch (const std::exception& error) {
      logError("a query failed: {}", error.what());
      done(makeError(v1::ERROR_INTERNAL, error.what()));
    }
  });
}

void QueryService::finish() {
  state_->thread.finish();
  state_->navigationThread.finish();
}

}  // namespace enfilade::server
