// Subscriptions to pictures: one at a time of each, the latest tick, and what was left out is
// counted. On the tick thread.
#pragma once

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// Begins, replaces or ends a watch; what is wrong with the request, if anything. The first picture
/// is of the last tick.
std::optional<v1::Error> watchFrames(ServedWorld& served, ClientId id, Client& client,
                                     const v1::WatchFrames& wanted);

/// Has the pictures drawn that are due with this tick.
void drawWatched(ServedWorld& served, ClientId id, Client& client);

/// For a picture that is to be drawn: what hands it to the recording too, if that takes it; else
/// empty.
decltype(FrameJob::seen) toRecording(const ServedWorld& served, const v1::FrameRequest& request);

/// What everyone sees, when the recording is to have it.
void drawRecorded(ServedWorld& served);

}  // namespace enfilade::server
