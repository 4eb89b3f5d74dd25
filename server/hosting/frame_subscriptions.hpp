// Frame subscriptions: at most one frame of each is in progress, always of the latest tick. Skipped
// frames are counted. Tick thread only.
#pragma once

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// Starts, replaces or ends a subscription; returns the error of an invalid request. The first
/// frame shows the last tick.
std::optional<v1::Error> updateFrameSubscription(HostedWorld& hosted, ClientId id, Client& client,
                                                 const v1::WatchFrames& request);

/// Renders the client's subscribed frames that are due at this tick.
void renderSubscribed(HostedWorld& hosted, ClientId id, Client& client);

/// Returns a FrameJob::onRendered callback that also records the frame; empty if frames of this
/// request are not recorded.
decltype(FrameJob::onRendered) makeRecordingObserver(const HostedWorld& hosted,
                                                     const v1::FrameRequest& request);

/// Renders all avatars' views for the recording, if they are due.
void renderRecorded(HostedWorld& hosted);

}  // namespace enfilade::server
