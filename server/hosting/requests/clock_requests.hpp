// Requests that control time: steps, the clock, restart, seek, take over, and the events of a
// recording.
#pragma once

#include "server/hosting/requests/request_context.hpp"

namespace enfilade::server {

/// Makes the client the driver if the clock has no driver; an error if another client drives it.
std::optional<v1::Error> acquireClock(const RequestContext& context);
/// An error if another client has avatars, and this one is no admin.
std::optional<v1::Error> validateOwnsAvatars(const RequestContext& context);

void handleStep(const RequestContext& context, const v1::Step& step);
void handleSetClock(const RequestContext& context, const v1::SetClock& request);
void handleRestart(const RequestContext& context);
void handleSeek(const RequestContext& context, const v1::Seek& request);
void handleRecordedEvents(const RequestContext& context, const v1::RecordedEventsRequest& request);
void handleTakeOver(const RequestContext& context, const v1::TakeOver& request);

}  // namespace enfilade::server
