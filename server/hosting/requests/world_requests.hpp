// Handles the requests that create, drop, list and jointly step worlds.
#pragma once

#include "server/hosting/requests/request_context.hpp"

namespace enfilade::server {

void handleCreateWorld(const RequestContext& context, const v1::CreateWorld& request);
void handleDropWorld(const RequestContext& context, const v1::DropWorld& request);
void handleListWorlds(const RequestContext& context);
void handleStepMany(const RequestContext& context, const v1::StepMany& request);

}  // namespace enfilade::server
