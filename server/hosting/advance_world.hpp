// Runs one tick of a hosted world. Tick thread only.
#pragma once

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// Runs one tick and sends subscribed data to all clients. Pauses a replay at its end.
void advance(HostedWorld& hosted);

}  // namespace enfilade::server
