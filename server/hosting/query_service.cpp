#include "server/hosting/query_service.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <optional>

#include "server/base/work_thread.hpp"
#include "server/messages/proximity_messages.hpp"
#include "server/messages/ray_messages.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

struct QuestionService::State {
  explicit State(std::shared_ptr<const scene::Scene> s) : scene(std::move(s)) {}

  std::shared_ptr<const scene::Scene> scene;
  std::optional<scene::RayCaster> caster;           ///< once somebody asked for rays
  std::shared_ptr<const scene::Snapshot> followed;  ///< where the caster has what moves
  std::optional<scene::SceneIndex> index;           ///< once somebody asked for pairs
  WorkThread thread;                                // last: it uses the others

  const scene::RayCaster& casterAt(const std::shared_ptr<const scene::Snapshot>& snapshot);
  scene::SceneThen then(const Question& question);
  std::variant<v1::RayReply, v1::Error> rays(const Question& question,
                                             std::vector<std::uint8_t>& attachment);
  Encoded answer(const Question& question);
  Encoded answerOrSayWhyNot(const Question& question);
};

const scene::RayCaster& QuestionService::State::casterAt(
    const std::shared_ptr<const scene::Snapshot>& snapshot) {
  if (!caster) {
    const auto start = std::chrono::steady_clock::now();
    caster.emplace(scene);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    spdlog::info("rays: the scene's tree was built in {:.2f} s", seconds.count());
  }
  if (followed != snapshot) {
    followed.reset();  // until all is placed
    caster->follow(*snapshot);
    followed = snapshot;
  }
  return *caster;
}

scene::SceneThen QuestionService::State::then(const Question& question) {
  if (!index) index.emplace(scene);
  return {*index, *question.snapshot};
}

std::variant<v1::RayReply, v1::Error> QuestionService::State::rays(
    const Question& question, std::vector<std::uint8_t>& attachment) {
  auto asked = raysFrom(question.message.rays(), *question.snapshot, question.limits);
  if (auto* error = std::get_if<v1::Error>(&asked)) return std::move(*error);
  return answerOf(std::get<AskedRays>(asked), casterAt(question.snapshot), *scene,
                  *question.snapshot, attachment);
}

namespace {

/// Takes the answer for `field` of the message, or the error.
template <class Answer>
void put(v1::ServerMessage& message, std::variant<Answer, v1::Error> answer,
         Answer* (v1::ServerMessage::*field)()) {
  if (auto* error = std::get_if<v1::Error>(&answer))
    *message.mutable_error() = std::move(*error);
  else
    *(message.*field)() = std::get<Answer>(std::move(answer));
}

}  // namespace

Encoded QuestionService::State::answer(const Question& question) {
  const v1::ClientMessage& asked = question.message;
  std::vector<std::uint8_t> attachment;
  v1::ServerMessage reply;
  reply.set_reply_to(asked.request_id());
  if (asked.has_rays())
    put(reply, rays(question, attachment), &v1::ServerMessage::mutable_rays);
  else if (asked.has_distances())
    put(reply, answerOf(asked.distances(), then(question), question.limits),
        &v1::ServerMessage::mutable_distances);
  else if (asked.has_touching())
    put(reply, answerOf(asked.touching(), then(question), question.lengths, question.limits),
        &v1::ServerMessage::mutable_touching);
  else
    put(reply, answerOf(asked.cannot_touch(), then(question), question.lengths),
        &v1::ServerMessage::mutable_cannot_touch);
  return encodeShared(reply, std::move(attachment));
}

Encoded QuestionService::State::answerOrSayWhyNot(const Question& question) {
  try {
    return answer(question);
  } catch (const std::exception& error) {
    spdlog::error("a question could not be answered: {}", error.what());
    return errorReply(question.message.request_id(), errorOf(v1::ERROR_INTERNAL, error.what()));
  }
}

QuestionService::QuestionService(std::shared_ptr<const scene::Scene> scene)
    : state_(std::make_unique<State>(std::move(scene))) {}

QuestionService::~QuestionService() {
  finish();
}

void QuestionService::ask(Question question, std::function<void(Encoded)> done) {
  const auto shared = std::make_shared<const Question>(std::move(question));
  state_->thread.post([state = state_.get(), shared, done = std::move(done)] {
    done(state->answerOrSayWhyNot(*shared));
  });
}

void QuestionService::finish() {
  state_->thread.finish();
}

}  // namespace enfilade::server
