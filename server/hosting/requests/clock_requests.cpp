#include "server/hosting/requests/clock_requests.hpp"

#include "collision/assert.hpp"
#include "server/hosting/replay_control.hpp"
#include "server/hosting/world_lifecycle.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

std::optional<v1::Error> acquireClock(const RequestContext& context) {
  std::optional<ClientId>& driver = context.hosted.clock.driver;
  if (!driver) driver = context.clientId;
  publishStatus(context.hosted);
  if (driver == context.clientId) return std::nullopt;
  return makeError(v1::ERROR_NOT_ALLOWED, "another client drives the clock: wait until it leaves");
}

std::optional<v1::Error> validateOwnsAvatars(const RequestContext& context) {
  if (context.client.role == Role::admin) return std::nullopt;
  for (const auto& [avatar, owner] : context.hosted.owners)
    if (owner != context.clientId)
      return makeError(v1::ERROR_NOT_ALLOWED,
                       "avatar '" + avatar +
                           "' belongs to another client: this needs a token with the role admin");
  return std::nullopt;
}

void handleStep(const RequestContext& context, const v1::Step& step) {
  const std::uint32_t maxTicks = context.hosted.limits.ticksPerStep;
  if (step.ticks() < 1 || step.ticks() > maxTicks) {
    return replyError(
        context, v1::ERROR_BAD_MESSAGE,
        "step.ticks = " + std::to_string(step.ticks()) + ": give 1 to " + std::to_string(maxTicks),
        "step.ticks");
  }
  if (context.hosted.clock.mode != v1::Clock::MODE_LOCKSTEP) {
    return replyError(context, v1::ERROR_NOT_ALLOWED,
                      "the clock is not in lockstep: set it to lockstep first");
  }
  auto error = acquireClock(context);
  if (!error) error = validateReplayRunning(context.hosted);
  if (error) return replyError(context, std::move(*error));
  ENFILADE_ASSERT(!context.client.pendingStep);
  context.client.pendingStep = {context.message.request_id(), step.ticks(), step.avatars()};
}

void handleSetClock(const RequestContext& context, const v1::SetClock& request) {
  constexpr double kMinSpeed = 1e-3, kMaxSpeed = 1000;
  const double speed = request.free_run().speed();
  const bool hasMode = request.mode_case() != v1::SetClock::MODE_NOT_SET;
  if (!hasMode && !request.release()) {
    return replyError(context, v1::ERROR_BAD_MESSAGE,
                      "mode is missing: give lockstep, free_run or pause, or release",
                      "set_clock.mode");
  }
  if (speed != 0 && !(speed >= kMinSpeed && speed <= kMaxSpeed)) {
    return replyError(context, v1::ERROR_BAD_MESSAGE,
                      "free_run.speed = " + std::to_string(speed) + ": give 0.001 to 1000",
                      "set_clock.free_run.speed");
  }
  if (auto error = acquireClock(context)) return replyError(context, std::move(*error));
  WorldClock& clock = context.hosted.clock;
  if (hasMode) {
    clock.mode = request.has_lockstep()   ? v1::Clock::MODE_LOCKSTEP
                 : request.has_free_run() ? v1::Clock::MODE_FREE_RUN
                                          : v1::Clock::MODE_PAUSED;
    clock.speed = speed > 0 ? speed : 1;
    clock.nextTick = std::chrono::steady_clock::now();
  }
  if (request.release()) clock.driver.reset();
  publishStatus(context.hosted);
  broadcastReplay(context.hosted);
  v1::ServerMessage message;
  *message.mutable_set_clock()->mutable_clock() = toProto(clock);
  message.mutable_set_clock()->set_tick(getLastTick(context.hosted));
  sendReply(context, std::move(message));
}

void handleRestart(const RequestContext& context) {
  if (auto error = validateAcceptsCommands(context.hosted))
    return replyError(context, std::move(*error));
  if (context.hosted.clock.mode != v1::Clock::MODE_LOCKSTEP) {
    return replyError(context, v1::ERROR_NOT_ALLOWED,
                      "a world restarts only in lockstep: set the clock to lockstep first");
  }
  auto error = validateOwnsAvatars(context);
  if (!error) error = acquireClock(context);
  if (error) return replyError(context, std::move(*error));
  resetWorld(context.hosted);
  publishStatus(context.hosted);
  const auto snapshot = context.hosted.world.snapshot();
  v1::ServerMessage message;
  message.mutable_restart()->set_tick(snapshot->tick);
  message.mutable_restart()->set_state_hash(snapshot->stateHash);
  sendReply(context, std::move(message));
}

void handleSeek(const RequestContext& context, const v1::Seek& request) {
  auto error = validateSeek(context.hosted, request);
  if (!error) error = acquireClock(context);
  if (!error) error = seekReplay(context.hosted, request);
  if (error) return replyError(context, std::move(*error));
  const auto snapshot = context.hosted.world.snapshot();
  v1::ServerMessage message;
  message.mutable_seek()->set_tick(snapshot->tick);
  message.mutable_seek()->set_time(snapshot->time);
  message.mutable_seek()->set_state_hash(snapshot->stateHash);
  sendReply(context, std::move(message));
}

void handleRecordedEvents(const RequestContext& context, const v1::RecordedEventsRequest& request) {
  if (auto error = validateHasReplay(context.hosted)) return replyError(context, std::move(*error));
  v1::ServerMessage message;
  *message.mutable_recorded_events() = context.hosted.replay->findEventsAfter(
      request.after_tick(), context.hosted.limits.replyBytes);
  sendReply(context, std::move(message));
}

void handleTakeOver(const RequestContext& context, const v1::TakeOver& request) {
  auto error = validateTakeOver(context.hosted, context.clientId, request);
  if (!error && !context.hosted.replay->branchTick()) error = acquireClock(context);
  if (!error) error = takeOverReplay(context.hosted, context.clientId, request);
  if (error) return replyError(context, std::move(*error));
  v1::ServerMessage message;
  message.mutable_take_over()->set_tick(getLastTick(context.hosted));
  sendReply(context, std::move(message));
}

}  // namespace enfilade::server
