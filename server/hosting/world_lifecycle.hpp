// Resets, replaces and closes a world, and notifies its clients. Tick thread only.
#pragma once

#include "server/hosting/hosted_world.hpp"

namespace enfilade::server {

/// Resets the world to tick 0. Clients receive the end of contacts and the leave notices.
void resetWorld(HostedWorld& hosted);

/// The fate of the recording of a world that is replaced.
enum class RecordingAfter : std::uint8_t { ends, continues };

/// Replaces the world by another one of the same scene (seek, restore). Clients receive the end of
/// the old contacts, then `activeContacts`, states and frames; notices of avatars that appear or
/// vanish name the `cause`. Avatars have no owner afterwards.
void replaceWorld(HostedWorld& hosted, scene::World world, const v1::TickEvents& activeContacts,
                  const std::string& cause, RecordingAfter recording = RecordingAfter::ends);

v1::Bye makeBye(v1::ErrorCode code, const std::string& reason);
Buffer encodeBye(const v1::Bye& closeNotice);

/// Ends all contacts, answers open requests with an error, and sends `closeNotice` to all clients.
void closeWorld(HostedWorld& hosted);

/// Sends `closeNotice` to all clients without using the world, which has failed.
void abortWorld(HostedWorld& hosted);

}  // namespace enfilade::server
