#include "server/hosting/requests/dispatch.hpp"

#include "collision/assert.hpp"
#include "protocol/framing.hpp"
#include "protocol/unknown_enums.hpp"
#include "server/hosting/requests/checkpoint_requests.hpp"
#include "server/hosting/requests/clock_requests.hpp"
#include "server/hosting/requests/command_requests.hpp"
#include "server/hosting/requests/frame_requests.hpp"
#include "server/hosting/requests/query_requests.hpp"
#include "server/hosting/requests/subscription_requests.hpp"
#include "server/hosting/requests/world_requests.hpp"
#include "server/log/log.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

/// Earlier requests are already answered; the session closes after this reply.
void handleBye(const RequestContext& context) {
  ENFILADE_ASSERT(!context.client.pendingReply && !context.client.pendingStep);
  v1::ServerMessage message;
  message.mutable_bye()->set_reason("the client said bye");
  context.client.out->finish(encodeShared(message));
}

/// The lowest role that may send this navigation request.
Role getRequiredRole(v1::NavigationQuery::QueryCase query) {
  switch (query) {  // no `default`, as below
    case v1::NavigationQuery::kPath:
    case v1::NavigationQuery::kRandom:
    case v1::NavigationQuery::kSnap:
    case v1::NavigationQuery::kSteps:
    case v1::NavigationQuery::kClearance:
    case v1::NavigationQuery::kMap:
    case v1::NavigationQuery::kIslands:
    case v1::NavigationQuery::kMesh:
    case v1::NavigationQuery::kSaveMesh:
    case v1::NavigationQuery::QUERY_NOT_SET:
      return Role::observe;
    case v1::NavigationQuery::kLoadMesh:
      return Role::drive;
  }
  return Role::admin;
}

/// The lowest role that may send this request.
Role getRequiredRole(const v1::ClientMessage& message) {
  switch (message.body_case()) {  // no `default`: the compiler rejects a request without a role
    case v1::ClientMessage::kHello:
    case v1::ClientMessage::kSubscribe:
    case v1::ClientMessage::kFrame:
    case v1::ClientMessage::kWatchFrames:
    case v1::ClientMessage::kRays:
    case v1::ClientMessage::kDistances:
    case v1::ClientMessage::kTouching:
    case v1::ClientMessage::kCannotTouch:
    case v1::ClientMessage::kDescribe:
    case v1::ClientMessage::kMetrics:
    case v1::ClientMessage::kFloorPlan:
    case v1::ClientMessage::kListWorlds:
    case v1::ClientMessage::kRecordedEvents:
    case v1::ClientMessage::kStepMany:
    case v1::ClientMessage::kSave:
    case v1::ClientMessage::kBye:
    case v1::ClientMessage::BODY_NOT_SET:
      return Role::observe;
    case v1::ClientMessage::kNavigation:
      return getRequiredRole(message.navigation().query_case());
    case v1::ClientMessage::kCommand:
    case v1::ClientMessage::kBodyCommand:
    case v1::ClientMessage::kStep:
    case v1::ClientMessage::kSetClock:
    case v1::ClientMessage::kSeek:
    case v1::ClientMessage::kTakeOver:
    case v1::ClientMessage::kRestart:
    case v1::ClientMessage::kRestore:
    case v1::ClientMessage::kUpload:
      return Role::drive;
    case v1::ClientMessage::kCreateWorld:
    case v1::ClientMessage::kDropWorld:
      return Role::admin;
  }
  return Role::admin;
}

/// `unknown`: as from protocol::findUnknownEnum().
void refuseUnknownEnum(const RequestContext& context, const std::string& unknown) {
  const std::string reason =
      unknown + ": not a value of protocol " + std::string(protocol::kVersion);
  std::string field = unknown.substr(0, unknown.find(' '));
  const bool isCommand = context.message.has_command() || context.message.has_body_command();
  if (!isCommand) return replyError(context, v1::ERROR_BAD_MESSAGE, reason, field);
  // Fields of commands begin with the order.
  refuseCommand(context,
                makeError(v1::ERROR_BAD_MESSAGE, reason, field.substr(field.find('.') + 1)));
}

void dispatchRequest(const RequestContext& context) {
  const v1::ClientMessage& message = context.message;
  const Role required = getRequiredRole(message);
  if (context.client.role < required) {
    return replyError(context, v1::ERROR_NOT_ALLOWED,
                      std::string("this needs a token with the role ") + toString(required) +
                          ", and yours is " + toString(context.client.role) +
                          ": ask the server's operator for one");
  }
  if (const std::string unknown = protocol::findUnknownEnum(message); !unknown.empty())
    return refuseUnknownEnum(context, unknown);
  switch (message.body_case()) {
    case v1::ClientMessage::kCommand:
      return handleCommand(context, message.command());
    case v1::ClientMessage::kBodyCommand:
      return handleBodyCommand(context, message.body_command());
    case v1::ClientMessage::kStep:
      return handleStep(context, message.step());
    case v1::ClientMessage::kSetClock:
      return handleSetClock(context, message.set_clock());
    case v1::ClientMessage::kRestart:
      return handleRestart(context);
    case v1::ClientMessage::kSeek:
      return handleSeek(context, message.seek());
    case v1::ClientMessage::kTakeOver:
      return handleTakeOver(context, message.take_over());
    case v1::ClientMessage::kRecordedEvents:
      return handleRecordedEvents(context, message.recorded_events());
    case v1::ClientMessage::kSave:
      return handleSaveWorld(context);
    case v1::ClientMessage::kRestore:
      return handleRestoreWorld(context, message.restore());
    case v1::ClientMessage::kUpload:
      return handleUpload(context, message.upload());
    case v1::ClientMessage::kSubscribe:
      return handleSubscribe(context, message.subscribe());
    case v1::ClientMessage::kFrame:
      return handleFrame(context, message.frame());
    case v1::ClientMessage::kWatchFrames:
      return handleWatchFrames(context, message.watch_frames());
    case v1::ClientMessage::kRays:
      return forwardQuery(context, message.rays(), "rays.tick");
    case v1::ClientMessage::kDistances:
      return forwardQuery(context, message.distances(), "distances.tick");
    case v1::ClientMessage::kTouching:
      return forwardQuery(context, message.touching(), "touching.tick");
    case v1::ClientMessage::kCannotTouch:
      return forwardQuery(context, message.cannot_touch(), "cannot_touch.tick");
    case v1::ClientMessage::kFloorPlan:
      return submitQuery(context);
    case v1::ClientMessage::kNavigation:
      return handleNavigation(context, message.navigation());
    case v1::ClientMessage::kDescribe:
      return handleDescribe(context, message.describe());
    case v1::ClientMessage::kMetrics:
      return handleMetrics(context);
    case v1::ClientMessage::kCreateWorld:
      return handleCreateWorld(context, message.create_world());
    case v1::ClientMessage::kDropWorld:
      return handleDropWorld(context, message.drop_world());
    case v1::ClientMessage::kListWorlds:
      return handleListWorlds(context);
    case v1::ClientMessage::kStepMany:
      return handleStepMany(context, message.step_many());
    case v1::ClientMessage::kHello:
      return replyError(context, v1::ERROR_NOT_ALLOWED,
                        "hello was already sent: reconnect to send another");
    case v1::ClientMessage::kBye:
      return handleBye(context);
    case v1::ClientMessage::BODY_NOT_SET:
      break;
  }
  replyError(context, v1::ERROR_UNSUPPORTED, "this server does not know the request", "body");
}

/// An internal error in a request affects only the requesting client.
void handleSafely(const RequestContext& context) {
  try {
    dispatchRequest(context);
  } catch (const std::exception& error) {
    logError("a request of '{}' failed: {}", context.client.name, error.what());
    context.client.pendingReply.reset();
    context.client.pendingStep.reset();
    replyError(context, v1::ERROR_INTERNAL, error.what());
  }
}

}  // namespace

void processQueue(HostedWorld& hosted, ClientId id) {
  const auto found = hosted.clients.find(id);
  if (found == hosted.clients.end() || hosted.closeNotice) return;
  Client& client = found->second;
  // A disconnected client gets no replies and must not delay other clients.
  while (!client.queue.empty() && !client.pendingStep && !client.pendingReply &&
         !client.out->finished()) {
    const QueuedRequest request = std::move(client.queue.front());
    client.queue.pop_front();
    handleSafely({hosted, id, client, request.message, processQueue});
  }
}

}  // namespace enfilade::server
