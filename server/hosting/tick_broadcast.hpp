// Events and states of a tick, serialized once for all clients. Tick thread only.
#pragma once

#include <array>

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// The messages of one tick, serialized at first use. Clients with equal subscriptions share the
/// bytes: with hundreds of clients, serialization would dominate the tick otherwise.
struct TickBroadcast {
  const v1::TickEvents& tickEvents;                       ///< of all entities
  std::vector<v1::ContactEvent> persistentContacts = {};  ///< appended to them
  std::array<Buffer, 16> eventBuffers = {};  ///< serialized, indexed by subscription flags
  Buffer stateBuffer = {};                   ///< serialized
  /// Sent to their subscribers; null: none.
  const scene::ContactHorizons* horizons = nullptr;
};

/// Sends the events of the client's subscription.
void sendEvents(Client& client, TickBroadcast& outgoing);
/// Sends the state if the client's subscription is due.
void sendState(HostedWorld& hosted, Client& client, const scene::Snapshot& snapshot,
               TickBroadcast& outgoing);
/// Sends events to all clients.
void broadcastEvents(HostedWorld& hosted, const v1::TickEvents& events);

}  // namespace enfilade::server
