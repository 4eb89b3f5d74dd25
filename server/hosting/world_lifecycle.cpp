#include "server/hosting/world_lifecycle.hpp"

#include "collision/assert.hpp"
#include "server/hosting/frame_subscriptions.hpp"
#include "server/hosting/horizon_subscriptions.hpp"
#include "server/hosting/tick_broadcast.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

void failPendingRequests(Client& client, const v1::Bye& closeNotice) {
  const v1::Error error = makeError(closeNotice.code(), closeNotice.reason());
  if (client.pendingReply && client.pendingReply->claim())
    sendError(client, client.pendingReply->requestId, error);
  if (client.pendingStep) sendError(client, client.pendingStep->requestId, error);
  for (const QueuedRequest& request : client.queue) {
    if (!request.message.has_bye()) sendError(client, request.message.request_id(), error);
  }
}

void sendBye(Client& client, const v1::Bye& closeNotice) {
  failPendingRequests(client, closeNotice);
  client.out->finish(encodeBye(closeNotice));
}

void resetSubscriptionTimes(Client& client) {
  client.nextStateTime = 0;
  for (auto& [number, subscription] : client.frameSubscriptions) subscription.nextTime = 0;
}

/// Adds a notice for each avatar of `one` that is not in `other`.
void addPresenceNotices(const scene::Snapshot& one, const scene::Snapshot& other,
                        v1::Notice::Kind kind, const std::string& cause, v1::TickEvents& events) {
  for (const scene::AvatarSnapshot& avatar : one.avatars) {
    if (findAvatar(other, avatar.name)) continue;
    v1::Notice& notice = *events.add_notices();
    notice.set_tick(one.tick);
    notice.set_kind(kind);
    notice.set_avatar(avatar.name);
    notice.set_id(avatar.id);
    *notice.mutable_position() = toProto(avatar.footPosition);
    notice.set_text(cause);
  }
}

/// Forgets what belongs to the world before: only the new one's first snapshot remains.
void clearRunState(HostedWorld& hosted) {
  resetHorizons(hosted);
  hosted.owners.clear();
  hosted.pendingRelease.clear();
  hosted.activeContacts.clear();
  hosted.keptPaths = std::make_shared<KeptPaths>();  // queries on their way hold those before
  hosted.recentSnapshots = {hosted.world.snapshot()};
}

}  // namespace

void resetWorld(HostedWorld& hosted) {
  const v1::TickEvents events =
      hosted.world.endContacts(v1::ContactEvent::REASON_RESTART, "the world was reset");
  broadcastEvents(hosted, events);
  for (auto& [id, client] : hosted.clients) resetSubscriptionTimes(client);
  hosted.world.reset(makeInitialWorld(hosted.scene, hosted.world.settings(), hosted.auditEvery));
  clearRunState(hosted);
  hosted.idle = true;
  for (auto& [id, viewer] : hosted.viewers) viewer.onReplaced(hosted.world, hosted.activeContacts);
}

void replaceWorld(HostedWorld& hosted, scene::World world, const v1::TickEvents& activeContacts,
                  const std::string& cause, RecordingAfter recording) {
  const auto before = hosted.world.snapshot(), after = world.snapshot();
  v1::TickEvents ended = hosted.world.endContacts(v1::ContactEvent::REASON_SEEK);
  addPresenceNotices(*before, *after, v1::Notice::KIND_LEFT, cause, ended);
  broadcastEvents(hosted, ended);
  v1::TickEvents begun = activeContacts;
  addPresenceNotices(*after, *before, v1::Notice::KIND_SPAWNED, cause, begun);
  if (recording == RecordingAfter::continues)
    hosted.world.restore(std::move(world), activeContacts);
  else
    hosted.world.switchTo(std::move(world));
  clearRunState(hosted);
  updateActiveContacts(hosted, activeContacts);
  publishStatus(hosted);
  TickBroadcast shared{begun};
  for (auto& [id, client] : hosted.clients) {
    sendEvents(client, shared);
    resetSubscriptionTimes(client);
    for (auto& [number, subscription] : client.frameSubscriptions)
      subscription.stale = subscription.rendering;
    sendState(hosted, client, *hosted.world.snapshot(), shared);
    renderSubscribed(hosted, id, client);
  }
  for (auto& [id, viewer] : hosted.viewers) viewer.onReplaced(hosted.world, hosted.activeContacts);
}

v1::Bye makeBye(v1::ErrorCode code, const std::string& reason) {
  v1::Bye closeNotice;
  closeNotice.set_code(code);
  closeNotice.set_reason(reason);
  return closeNotice;
}

Buffer encodeBye(const v1::Bye& closeNotice) {
  v1::ServerMessage message;
  *message.mutable_bye() = closeNotice;
  return encodeShared(message);
}

void closeWorld(HostedWorld& hosted) {
  const v1::TickEvents events = hosted.world.endContacts(v1::ContactEvent::REASON_SHUTDOWN);
  broadcastEvents(hosted, events);
  if (!hosted.closeNotice)
    hosted.closeNotice = makeBye(v1::ERROR_SHUTTING_DOWN, "the server is stopping");
  abortWorld(hosted);
  if (WorldRecorder* recorder = hosted.world.recorder()) recorder->close();
}

void abortWorld(HostedWorld& hosted) {
  ENFILADE_ASSERT(hosted.closeNotice);
  for (auto& [id, client] : hosted.clients) sendBye(client, *hosted.closeNotice);
  hosted.clients.clear();
  hosted.viewers.clear();
}

}  // namespace enfilade::server
