// Calls the handler of each client request, if the client has the required role. Tick thread only.
#pragma once

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// Handles the client's queued requests in order, until one has to wait for ticks or for a service.
void processQueue(HostedWorld& hosted, ClientId id);

}  // namespace enfilade::server
