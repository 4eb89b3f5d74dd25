// What clients do with a world that plays a recording: seek in it, and take it over. On the tick
// thread.
#pragma once

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// How the replay stands. Only of a world that plays a recording.
v1::Replay replayOf(const ServedWorld& served);
/// Tells it to all clients; does nothing where no recording is played.
void tellReplay(ServedWorld& served);

/// Why a replay makes no tick now; nullopt: it does, or no recording is played.
std::optional<v1::Error> replayEnded(const ServedWorld& served);
/// Why the world takes no commands: it is a replay that is not branched; nullopt: it does.
std::optional<v1::Error> onlyReplayed(const ServedWorld& served);

// What is wrong with a request; it changes nothing then.

std::optional<v1::Error> seekProblem(const ServedWorld& served, const v1::Seek& wanted);
std::optional<v1::Error> takeOverProblem(const ServedWorld& served, ClientId id,
                                         const v1::TakeOver& wanted);

// Both do it where there is no such problem, and tell what else was wrong.

std::optional<v1::Error> seek(ServedWorld& served, const v1::Seek& wanted);
std::optional<v1::Error> takeOver(ServedWorld& served, ClientId id, const v1::TakeOver& wanted);

}  // namespace enfilade::server
