// Subscriptions to contact horizons: one schedule of pairs serves all clients of a world. Tick
// thread only.
#pragma once

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// Error if the subscription's request for contact horizons is invalid. Avatars of the client's
/// present request may have left.
std::optional<v1::Error> validateHorizons(const HostedWorld& hosted, const Client& client,
                                          const v1::Subscribe& subscription);
/// Prepares for the request that follows the client's present one.
void changeHorizons(HostedWorld& hosted, Client& client, const v1::Subscribe& subscription);
/// Advances the horizons to the last tick, if a client subscribes to them.
void updateHorizons(HostedWorld& hosted);
/// Forgets all horizons: the world was replaced. Subscribers get all of them after the next tick.
void resetHorizons(HostedWorld& hosted);
/// Adds the client's horizons that differ from those sent last.
void addHorizons(Client& client, const scene::ContactHorizons& horizons, v1::TickEvents& events);

}  // namespace enfilade::server
