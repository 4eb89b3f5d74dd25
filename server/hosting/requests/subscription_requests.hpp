// Handles the requests Subscribe (states, events) and WatchFrames.
#pragma once

#include "server/hosting/requests/request_context.hpp"

namespace enfilade::server {

void handleSubscribe(const RequestContext& context, const v1::Subscribe& subscription);
void handleWatchFrames(const RequestContext& context, const v1::WatchFrames& request);

}  // namespace enfilade::server
