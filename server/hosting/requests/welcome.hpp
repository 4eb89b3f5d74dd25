// Makes the Welcome message, the first reply to a client.
#pragma once

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// Capabilities, scene, limits and clock of the world. Waits until the renderer is created.
v1::Welcome makeWelcome(const HostedWorld& hosted);

}  // namespace enfilade::server
