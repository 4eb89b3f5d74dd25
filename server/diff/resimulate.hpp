// A recorded walk, made again in another model: the change of a design, judged by those who walk in
// it.
#pragma once

#include "server/app/command_line.hpp"

namespace enfilade::server {

/// Writes contacts.jsonl, summary.json, pictures and the new recording as replay() does, diff.json,
/// diff.txt and changes/. `violations`: something got worse. Throws what replay() throws, and
/// protocol::mcap::RecordingError.
ExitCode rewalk(const RewalkCommand& command);

}  // namespace enfilade::server
