#include "server/hosting/requests/command_requests.hpp"

#include "server/hosting/replay_control.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

/// Avatars of a recording have no owner until a client takes them over.
std::optional<v1::Error> validateNotRecorded(const HostedWorld& hosted, const std::string& avatar) {
  if (!hosted.replay || !findAvatar(*hosted.world.snapshot(), avatar)) return std::nullopt;
  return makeError(v1::ERROR_NOT_ALLOWED,
                   "avatar '" + avatar + "' is recorded: use TakeOver to control it", "avatar");
}

std::optional<v1::Error> validateOwnership(const RequestContext& context,
                                           const v1::Command& command) {
  const auto owner = context.hosted.owners.find(command.avatar());
  if (owner == context.hosted.owners.end())
    return validateNotRecorded(context.hosted, command.avatar());
  if (owner->second == context.clientId) return std::nullopt;
  return makeError(v1::ERROR_NOT_ALLOWED,
                   "avatar '" + command.avatar() + "' belongs to another client: take another name",
                   "avatar");
}

std::optional<v1::Error> validateLimits(const RequestContext& context, const v1::Command& command) {
  const ServerLimits& limits = context.hosted.limits;
  const auto maxWaypoints = static_cast<int>(limits.waypoints);
  if (command.has_walk() && command.walk().along_size() > maxWaypoints) {
    return makeError(v1::ERROR_TOO_LARGE,
                     "walk.along has " + std::to_string(command.walk().along_size()) +
                         " waypoints; give at most " + std::to_string(maxWaypoints),
                     "walk.along");
  }
  const bool isNew = command.has_spawn() && !context.hosted.owners.contains(command.avatar());
  if (isNew && context.hosted.owners.size() >= limits.avatars) {
    return makeError(
        v1::ERROR_TOO_LARGE,
        "the world has its " + std::to_string(limits.avatars) + " avatars: wait until one leaves",
        "spawn");
  }
  return std::nullopt;
}

std::optional<v1::Error> submitCommand(const RequestContext& context, const v1::Command& command) {
  if (auto error = validateAcceptsCommands(context.hosted)) return error;
  if (auto error = validateOwnership(context, command)) return error;
  if (auto error = validateLimits(context, command)) return error;
  if (auto refused = context.hosted.world.submit(command)) return refused;
  if (command.has_spawn()) {
    context.hosted.owners[command.avatar()] = context.clientId;
    context.hosted.pendingRelease.insert(command.avatar());
  }
  return std::nullopt;
}

void sendCommandReply(const RequestContext& context, std::optional<v1::Error> error) {
  v1::ServerMessage message;
  v1::CommandReply& body = *message.mutable_command();
  body.set_accepted(!error);
  if (error) {
    *body.mutable_error() = std::move(*error);
  } else {
    body.set_tick(lastTick(context.hosted) + 1);
  }
  sendReply(context, std::move(message));
}

}  // namespace

void refuseCommand(const RequestContext& context, v1::Error error) {
  sendCommandReply(context, std::move(error));
}

void handleCommand(const RequestContext& context, const v1::Command& command) {
  sendCommandReply(context, submitCommand(context, command));
}

void handleBodyCommand(const RequestContext& context, const v1::BodyCommand& command) {
  auto error = validateAcceptsCommands(context.hosted);
  sendCommandReply(context, error ? std::move(error) : context.hosted.world.submit(command));
}

}  // namespace enfilade::server
