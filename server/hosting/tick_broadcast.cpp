#include "server/hosting/tick_broadcast.hpp"

#include "collision/assert.hpp"
#include "protocol/framing.hpp"
#include "server/hosting/horizon_subscriptions.hpp"

namespace enfilade::server {
namespace {

Buffer serialize(const google::protobuf::MessageLite& message) {
  std::vector<std::uint8_t> bytes(message.ByteSizeLong());
  message.SerializeWithCachedSizesToArray(bytes.data());
  return std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
}

EncodedMessage spliceMessage(int field, const std::string& own, const Buffer& shared) {
  return {std::make_shared<const std::vector<std::uint8_t>>(
              protocol::encodeSplicedHead(static_cast<std::uint32_t>(field), own, shared->size())),
          shared};
}

bool isSubscribedTo(const v1::Subscribe& subscription, const v1::ContactEvent& event) {
  return event.kind() == v1::ContactEvent::KIND_NEAR ? subscription.near_misses()
                                                     : subscription.contacts();
}

/// Serialized TickEvents without the sequence; empty if no subscribed event happened.
const Buffer& findOrSerializeEvents(TickBroadcast& outgoing, const v1::Subscribe& subscription) {
  const std::size_t subscribed =
      (subscription.contacts() ? 1u : 0u) | (subscription.near_misses() ? 2u : 0u) |
      (subscription.notices() ? 4u : 0u) | (subscription.persists() ? 8u : 0u);
  ENFILADE_ASSERT(subscribed < outgoing.eventBuffers.size());
  Buffer& bytes = outgoing.eventBuffers[subscribed];
  if (bytes) return bytes;
  static const Buffer nothing = std::make_shared<const std::vector<std::uint8_t>>();
  if (outgoing.tickEvents.contacts().empty() && outgoing.tickEvents.notices().empty() &&
      outgoing.persistentContacts.empty())
    return nothing;
  v1::TickEvents events;
  for (const v1::ContactEvent& event : outgoing.tickEvents.contacts()) {
    if (isSubscribedTo(subscription, event)) *events.add_contacts() = event;
  }
  if (subscription.persists())
    for (const v1::ContactEvent& event : outgoing.persistentContacts)
      *events.add_contacts() = event;
  if (subscription.notices()) *events.mutable_notices() = outgoing.tickEvents.notices();
  if (!events.contacts().empty() || !events.notices().empty()) {
    events.set_tick(outgoing.tickEvents.tick());
    events.set_time(outgoing.tickEvents.time());
  }
  return bytes = serialize(events);
}

/// Serialized State without the client's `dropped`.
Buffer serializeState(const scene::World& world) {
  v1::State state;
  fillState(state, world);
  return serialize(state);
}

}  // namespace

void sendEvents(Client& client, TickBroadcast& outgoing) {
  const Buffer& shared = findOrSerializeEvents(outgoing, client.subscription);
  v1::TickEvents own;
  if (outgoing.horizons) addHorizons(client, *outgoing.horizons, own);
  if (shared->empty()) {
    if (own.horizons().empty()) return;
    own.set_tick(outgoing.tickEvents.tick());
    own.set_time(outgoing.tickEvents.time());
  }
  own.set_sequence(++client.sequence);
  client.out->push(
      spliceMessage(v1::ServerMessage::kEventsFieldNumber, own.SerializeAsString(), shared));
}

void sendState(HostedWorld& hosted, Client& client, const scene::Snapshot& snapshot,
               TickBroadcast& outgoing) {
  ENFILADE_ASSERT(snapshot.tick == hosted.world.snapshot()->tick);
  const double tick = hosted.world.settings().tickDuration;
  if (!client.subscription.state() || snapshot.time + tick / 2 < client.nextStateTime) return;
  const double rate = client.subscription.state_rate();
  client.nextStateTime = snapshot.time + (rate > 0 ? 1 / rate : 0);
  if (client.out->dropLatest()) {
    ++client.droppedStates;
    ++hosted.droppedStates;
  } else {
    client.droppedStates = 0;
  }
  if (!outgoing.stateBuffer) outgoing.stateBuffer = serializeState(hosted.world);
  v1::State own;
  own.set_dropped(client.droppedStates);
  client.out->pushLatest(spliceMessage(v1::ServerMessage::kStateFieldNumber,
                                       own.SerializeAsString(), outgoing.stateBuffer));
}

void broadcastEvents(HostedWorld& hosted, const v1::TickEvents& events) {
  TickBroadcast shared{events};
  for (auto& [id, client] : hosted.clients) sendEvents(client, shared);
  for (auto& [id, viewer] : hosted.viewers) viewer.onEvents(events);
}

}  // namespace enfilade::server
