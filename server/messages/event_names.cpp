#include "server/messages/event_names.hpp"

#include "scene/model/ascii.hpp"

namespace enfilade::server {
namespace {

/// Returns the value's name in the schema, in lower case and without `prefix`.
template <class Enum>
std::string formatEnumName(Enum value, std::string_view prefix, const char* unknown) {
  const auto* known = google::protobuf::GetEnumDescriptor<Enum>()->FindValueByNumber(value);
  return known && value != 0 ? scene::toLowerCase(known->name().substr(prefix.size())) : unknown;
}

}  // namespace

std::string toString(v1::ContactEvent::Kind kind) {
  return formatEnumName(kind, "KIND_", "unknown");
}

std::string toString(v1::ContactEvent::Reason reason) {
  return formatEnumName(reason, "REASON_", "unknown");
}

std::string toString(v1::ContactEvent::Phase phase) {
  return formatEnumName(phase, "PHASE_", "unknown");
}

std::string toString(v1::Verdict verdict) {
  return formatEnumName(verdict, "VERDICT_", "unknown");
}

std::string toString(v1::Feature feature) {
  return formatEnumName(feature, "FEATURE_", "unknown");
}

std::string toString(v1::Notice::Kind kind) {
  return formatEnumName(kind, "KIND_", "other");
}

}  // namespace enfilade::server
