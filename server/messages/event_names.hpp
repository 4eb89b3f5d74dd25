// The words by which files tell what happened: contacts.jsonl, summary.json, diff.json.
#pragma once

#include "protocol/enfilade.pb.h"

namespace enfilade::server {

const char* wordOf(v1::ContactEvent::Kind kind);
const char* wordOf(v1::ContactEvent::Reason reason);
const char* wordOf(v1::ContactEvent::Phase phase);
const char* wordOf(v1::Verdict verdict);
const char* wordOf(v1::Feature feature);
const char* wordOf(v1::Notice::Kind kind);

}  // namespace enfilade::server
