// Names of events and enums in output files: contacts.jsonl, summary.json, diff.json.
#pragma once

#include <string>

#include "protocol/enfilade.pb.h"

namespace enfilade::server {

std::string toString(v1::ContactEvent::Kind kind);
std::string toString(v1::ContactEvent::Reason reason);
std::string toString(v1::ContactEvent::Phase phase);
std::string toString(v1::Verdict verdict);
std::string toString(v1::Feature feature);
std::string toString(v1::Notice::Kind kind);

}  // namespace enfilade::server
