#include "server/ray_service.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <optional>

#include "server/work_thread.hpp"
#include "server/world_messages.hpp"

namespace enfilade::server {

struct RayService::State {
  explicit State(std::shared_ptr<const scene::Scene> s) : scene(std::move(s)) {}

  std::shared_ptr<const scene::Scene> scene;
  std::optional<scene::RayCaster> caster;           ///< once somebody asked
  std::shared_ptr<const scene::Snapshot> followed;  ///< where the caster has what moves
  WorkThread thread;                                // last: it uses the others

  void follow(const std::shared_ptr<const scene::Snapshot>& snapshot);
  Buffer reply(const RayJob& job);
};

void RayService::State::follow(const std::shared_ptr<const scene::Snapshot>& snapshot) {
  if (!caster) {
    const auto start = std::chrono::steady_clock::now();
    caster.emplace(scene);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    spdlog::info("rays: the scene's tree was built in {:.2f} s", seconds.count());
  }
  if (followed == snapshot) return;
  caster->follow(*snapshot);
  followed = snapshot;
}

Buffer RayService::State::reply(const RayJob& job) {
  try {
    follow(job.snapshot);
    std::vector<std::uint8_t> attachment;
    v1::ServerMessage reply;
    reply.set_reply_to(job.requestId);
    *reply.mutable_rays() = answerOf(job.asked, *caster, *scene, *job.snapshot, attachment);
    return encodeShared(reply, attachment);
  } catch (const std::exception& error) {
    followed.reset();
    spdlog::error("rays could not be cast: {}", error.what());
    return errorReply(job.requestId, errorOf(v1::ERROR_INTERNAL, error.what()));
  }
}

RayService::RayService(std::shared_ptr<const scene::Scene> scene)
    : state_(std::make_unique<State>(std::move(scene))) {}

RayService::~RayService() {
  finish();
}

void RayService::cast(RayJob job, std::function<void(Buffer)> done) {
  const auto shared = std::make_shared<const RayJob>(std::move(job));
  state_->thread.post(
      [state = state_.get(), shared, done = std::move(done)] { done(state->reply(*shared)); });
}

void RayService::finish() {
  state_->thread.finish();
}

}  // namespace enfilade::server
