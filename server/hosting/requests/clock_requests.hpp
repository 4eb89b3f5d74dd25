// Requests that control time: steps, the clock, restart, seek and take over.
#pragma once

#include "server/hosting/requests/request_context.hpp"

namespace enfilade::server {

void handleStep(const RequestContext& context, const v1::Step& step);
void handleSetClock(const RequestContext& context, const v1::SetClock& request);
void handleRestart(const RequestContext& context);
void handleSeek(const RequestContext& context, const v1::Seek& request);
void handleTakeOver(const RequestContext& context, const v1::TakeOver& request);

}  // namespace enfilade::server
