// Client requests to a world that replays a recording: seek and take over. Tick thread only.
#pragma once

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// The status of the replay. `hosted` must replay a recording.
v1::Replay makeReplayStatus(const HostedWorld& hosted);
/// Sends the status to all clients; no effect without a replay.
void broadcastReplay(HostedWorld& hosted);

/// An error if the replay cannot tick; nullopt: it can, or the world is no replay.
std::optional<v1::Error> validateReplayRunning(const HostedWorld& hosted);
/// An error if the world is an unbranched replay, which refuses commands; nullopt: accepts them.
std::optional<v1::Error> validateAcceptsCommands(const HostedWorld& hosted);

/// An error if the world replays no recording.
std::optional<v1::Error> validateHasReplay(const HostedWorld& hosted);

// These check a request and change nothing; nullopt: valid.

std::optional<v1::Error> validateSeek(const HostedWorld& hosted, const v1::Seek& request);
std::optional<v1::Error> validateTakeOver(const HostedWorld& hosted, ClientId id,
                                          const v1::TakeOver& request);

// These execute a valid request and return errors that occur during the execution.

std::optional<v1::Error> seekReplay(HostedWorld& hosted, const v1::Seek& request);
std::optional<v1::Error> takeOverReplay(HostedWorld& hosted, ClientId id,
                                        const v1::TakeOver& request);

}  // namespace enfilade::server
