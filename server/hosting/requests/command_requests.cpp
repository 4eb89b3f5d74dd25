#include "server/hosting/requests/command_requests.hpp"

#include <utility>
#include <variant>

#include "server/hosting/replay_control.hpp"
#include "server/messages/world_messages.hpp"
#include "server/navigation/go_order.hpp"

namespace enfilade::server {
namespace {

/// Avatars of a recording have no owner until a client takes them over.
std::optional<v1::Error> validateNotRecorded(const HostedWorld& hosted, const std::string& avatar) {
  if (!hosted.replay || !findAvatar(*hosted.world.snapshot(), avatar)) return std::nullopt;
  return makeError(v1::ERROR_NOT_ALLOWED,
                   "avatar '" + avatar + "' is recorded: use TakeOver to control it", "avatar");
}

std::optional<v1::Error> validateOwnership(const HostedWorld& hosted, ClientId id,
                                           const v1::Command& command) {
  const auto owner = hosted.owners.find(command.avatar());
  if (owner == hosted.owners.end()) return validateNotRecorded(hosted, command.avatar());
  if (owner->second == id) return std::nullopt;
  return makeError(v1::ERROR_NOT_ALLOWED,
                   "avatar '" + command.avatar() + "' belongs to another client: take another name",
                   "avatar");
}

std::optional<v1::Error> validateLimits(const HostedWorld& hosted, const v1::Command& command) {
  const ServerLimits& limits = hosted.limits;
  const auto maxWaypoints = static_cast<int>(limits.waypoints);
  if (command.has_walk() && command.walk().along_size() > maxWaypoints) {
    return makeError(v1::ERROR_TOO_LARGE,
                     "walk.along has " + std::to_string(command.walk().along_size()) +
                         " waypoints; give at most " + std::to_string(maxWaypoints),
                     "walk.along");
  }
  const bool isNew = command.has_spawn() && !hosted.owners.contains(command.avatar());
  if (isNew && hosted.owners.size() >= limits.avatars) {
    return makeError(
        v1::ERROR_TOO_LARGE,
        "the world has its " + std::to_string(limits.avatars) + " avatars: wait until one leaves",
        "spawn");
  }
  return std::nullopt;
}

std::optional<v1::Error> validateCommand(const HostedWorld& hosted, ClientId id,
                                         const v1::Command& command) {
  if (auto error = validateAcceptsCommands(hosted)) return error;
  if (auto error = validateOwnership(hosted, id, command)) return error;
  return validateLimits(hosted, command);
}

std::optional<v1::Error> submitCommand(HostedWorld& hosted, ClientId id,
                                       const v1::Command& command) {
  if (auto error = validateCommand(hosted, id, command)) return error;
  if (auto refused = hosted.world.submit(command)) return refused;
  if (command.has_spawn()) {
    hosted.owners[command.avatar()] = id;
    hosted.pendingRelease.insert(command.avatar());
  }
  return std::nullopt;
}

v1::ServerMessage makeCommandReply(const HostedWorld& hosted, std::optional<v1::Error> error) {
  v1::ServerMessage message;
  v1::CommandReply& body = *message.mutable_command();
  body.set_accepted(!error);
  if (error) {
    *body.mutable_error() = std::move(*error);
  } else {
    body.set_tick(getLastTick(hosted) + 1);
  }
  return message;
}

void sendCommandReply(const RequestContext& context, std::optional<v1::Error> error) {
  sendReply(context, makeCommandReply(context.hosted, std::move(error)));
}

/// Finds the path off the tick thread, then submits it as a Walk.
void handleGo(const RequestContext& context, const v1::Command& command) {
  HostedWorld& hosted = context.hosted;
  if (auto error = validateCommand(hosted, context.clientId, command))
    return sendCommandReply(context, std::move(error));
  auto query = makePathQuery(hosted.world, command);
  if (auto* error = std::get_if<v1::Error>(&query))
    return sendCommandReply(context, std::move(*error));
  SceneQuery sceneQuery{hosted.world.snapshot(),
                        {},
                        hosted.world.settings(),
                        hosted.limits,
                        makeProgress(context, command.go().progress())};
  *sceneQuery.message.mutable_navigation() = std::get<v1::NavigationQuery>(std::move(query));
  hosted.queries.submitPath(
      std::move(sceneQuery),
      [reply = deferReply(context), post = hosted.post, id = context.clientId,
       requestId = context.message.request_id(), command](auto found) {
        post([reply, id, requestId, command, found = std::move(found)](HostedWorld& current) {
          if (!current.clients.contains(id)) return;
          auto made = makeGoOrder(command, found);
          std::optional<v1::Error> error;
          if (auto* refusal = std::get_if<v1::Error>(&made))
            error = std::move(*refusal);
          else
            error = submitCommand(current, id, std::get<v1::Command>(made));
          v1::ServerMessage message = makeCommandReply(current, std::move(error));
          message.set_reply_to(requestId);
          reply(encodeShared(message));
        });
      });
}

}  // namespace

void refuseCommand(const RequestContext& context, v1::Error error) {
  sendCommandReply(context, std::move(error));
}

void handleCommand(const RequestContext& context, const v1::Command& command) {
  if (command.has_go()) return handleGo(context, command);
  sendCommandReply(context, submitCommand(context.hosted, context.clientId, command));
}

void handleBodyCommand(const RequestContext& context, const v1::BodyCommand& command) {
  auto error = validateAcceptsCommands(context.hosted);
  sendCommandReply(context, error ? std::move(error) : context.hosted.world.submit(command));
}

}  // namespace enfilade::server
