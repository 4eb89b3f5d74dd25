// Names of events and enums in output files: contacts.jsonl, summary.json, diff.json.
#pragma once

#include "protocol/enfilade.pb.h"

namespace enfilade::server {

const char* toString(v1::ContactEvent::Kind kind);
const char* toString(v1::ContactEvent::Reason reason);
const char* toString(v1::ContactEvent::Phase phase);
const char* toString(v1::Verdict verdict);
const char* toString(v1::Feature feature);
const char* toString(v1::Notice::Kind kind);

}  // namespace enfilade::server
