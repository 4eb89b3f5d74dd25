#include "server/hosting/advance_world.hpp"

#include <algorithm>

#include "collision/assert.hpp"
#include "scene/world/active_contacts.hpp"
#include "server/base/audit_log.hpp"
#include "server/hosting/frame_subscriptions.hpp"
#include "server/hosting/horizon_subscriptions.hpp"
#include "server/hosting/replay_control.hpp"
#include "server/hosting/tick_broadcast.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

void sendStepReply(HostedWorld& hosted, Client& client, const scene::Snapshot& snapshot) {
  v1::ServerMessage message;
  message.set_reply_to(client.pendingStep->requestId);
  v1::StepReply& reply = *message.mutable_step();
  reply.set_tick(snapshot.tick);
  reply.set_time(snapshot.time);
  reply.set_state_hash(snapshot.stateHash);
  reply.set_idle(hosted.idle);
  if (client.pendingStep->includeAvatars) {
    for (const scene::AvatarSnapshot& avatar : snapshot.avatars) {
      *reply.add_avatars() = toProto(hosted.world, avatar);
    }
  }
  client.pendingStep.reset();
  sendMessage(client, message);
}

/// `stopped`: no more ticks follow.
void completeStep(HostedWorld& hosted, Client& client, bool stopped) {
  if (!client.pendingStep || (client.pendingStep->remaining > 0 && !stopped)) return;
  if (client.pendingStep->completed > 0)
    return sendStepReply(hosted, client, *hosted.world.snapshot());
  auto error = validateReplayRunning(hosted);
  ENFILADE_ASSERT(error);  // only a stopped replay completes a Step without a tick
  const std::uint64_t id = client.pendingStep->requestId;
  client.pendingStep.reset();
  sendError(client, id, std::move(*error));
}

bool hasPersistSubscriber(const HostedWorld& hosted) {
  return std::any_of(hosted.clients.begin(), hosted.clients.end(),
                     [](const auto& one) { return one.second.subscription.persists(); });
}

bool isNewContact(const HostedWorld& hosted, const scene::ContactEvent& contact) {
  const auto found = hosted.activeContacts.find({contact.a, contact.b});
  return found != hosted.activeContacts.end() && found->second.tick() == contact.tick;
}

/// The current state of contacts that are active after the last tick and began before it. Empty if
/// no client subscribed to them. Call it after updateActiveContacts().
std::vector<v1::ContactEvent> findPersistentContacts(const HostedWorld& hosted) {
  std::vector<v1::ContactEvent> persistent;
  if (!hasPersistSubscriber(hosted)) return persistent;
  for (const scene::ContactEvent& contact : scene::collectActiveContacts(hosted.world)) {
    const bool inTrigger = contact.kind == scene::ContactEvent::Kind::enter;
    if (inTrigger || isNewContact(hosted, contact)) continue;
    persistent.push_back(toProto(hosted.world, contact));
    persistent.back().set_kind(v1::ContactEvent::KIND_PERSIST);
  }
  return persistent;
}

/// Frees an avatar's name when the avatar is gone and its order queue is empty. Without an avatar
/// each queued order causes a notice, so a tick without a notice shows an empty queue.
void releaseOwners(HostedWorld& hosted, const std::vector<scene::Notice>& notices) {
  using Kind = scene::Notice::Kind;
  std::set<std::string> notified;
  for (const scene::Notice& notice : notices) notified.insert(notice.avatar);
  std::erase_if(hosted.pendingRelease, [&](const std::string& name) {
    if (notified.contains(name)) return false;
    if (!findAvatar(*hosted.world.snapshot(), name)) hosted.owners.erase(name);
    return true;
  });
  for (const scene::Notice& notice : notices) {
    if (notice.kind == Kind::left || notice.kind == Kind::refused) {
      hosted.pendingRelease.insert(notice.avatar);
    }
  }
}

/// Gives the TakeOver as the cause of dropped orders: the world knows only the Drive that stops the
/// avatar.
void renameTakeOvers(HostedWorld& hosted, v1::TickEvents& events) {
  for (v1::Notice& notice : *events.mutable_notices()) {
    if (notice.kind() != v1::Notice::KIND_DROPPED || !hosted.takenOver.contains(notice.avatar()))
      continue;
    const std::string cause = "by a Drive";
    if (notice.text().starts_with(cause))
      notice.set_text("by a TakeOver" + notice.text().substr(cause.size()));
  }
  hosted.takenOver.clear();
}

void broadcastTick(HostedWorld& hosted, RecordableWorld::TickResult& result) {
  if (!hosted.takenOver.empty()) renameTakeOvers(hosted, result.events);
  const auto& [report, events] = result;
  hosted.statistics.addTick(report);
  logFindings(hosted.world, report);
  hosted.idle = report.idle;
  hosted.recentSnapshots.push_back(report.snapshot);
  if (hosted.recentSnapshots.size() > kKeptSnapshots) hosted.recentSnapshots.pop_front();
  publishStatus(hosted);
  releaseOwners(hosted, report.notices);
  updateActiveContacts(hosted, events);
  updateHorizons(hosted);
  TickBroadcast shared{events, findPersistentContacts(hosted)};
  shared.horizons = hosted.horizons.get();
  for (auto& [id, client] : hosted.clients) {
    sendEvents(client, shared);
    sendState(hosted, client, *report.snapshot, shared);
    renderSubscribed(hosted, id, client);
    if (!client.pendingStep) continue;
    ENFILADE_ASSERT(client.pendingStep->remaining > 0);
    --client.pendingStep->remaining;
    ++client.pendingStep->completed;
  }
  for (auto& [id, viewer] : hosted.viewers) viewer.onTick(hosted.world, events);
  renderRecorded(hosted);
}

/// Stops playback until a client seeks or takes over.
void pauseReplay(HostedWorld& hosted) {
  ENFILADE_ASSERT(hosted.replay);
  if (hosted.clock.mode == v1::Clock::MODE_FREE_RUN) hosted.clock.mode = v1::Clock::MODE_PAUSED;
  publishStatus(hosted);
  broadcastReplay(hosted);
}

}  // namespace

void advance(HostedWorld& hosted) {
  auto result =
      hosted.replay ? hosted.replay->tick(hosted.world) : std::optional(hosted.world.tick());
  if (result) broadcastTick(hosted, *result);
  const bool stopped = !result || (hosted.replay && hosted.replay->atEnd());
  if (stopped) pauseReplay(hosted);
  for (auto& [id, client] : hosted.clients) completeStep(hosted, client, stopped);
}

}  // namespace enfilade::server
