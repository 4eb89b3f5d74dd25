// Requests that save the state of a world, and restore it.
#pragma once

#include "server/hosting/requests/request_context.hpp"

namespace enfilade::server {

void handleSaveWorld(const RequestContext& context);
void handleRestoreWorld(const RequestContext& context, const v1::RestoreWorld& request);

}  // namespace enfilade::server
