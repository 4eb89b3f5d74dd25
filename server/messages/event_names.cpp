#include "server/messages/event_names.hpp"

namespace enfilade::server {

const char* toString(v1::ContactEvent::Kind kind) {
  switch (kind) {
    case v1::ContactEvent::KIND_BEGIN:
      return "begin";
    case v1::ContactEvent::KIND_END:
      return "end";
    case v1::ContactEvent::KIND_NEAR:
      return "near";
    case v1::ContactEvent::KIND_BLOCKED:
      return "blocked";
    case v1::ContactEvent::KIND_ENTER:
      return "enter";
    case v1::ContactEvent::KIND_LEAVE:
      return "leave";
    case v1::ContactEvent::KIND_LEFT_WORLD:
      return "left_world";
    case v1::ContactEvent::KIND_PERSIST:
      return "persist";
    default:
      return "unknown";
  }
}

const char* toString(v1::ContactEvent::Reason reason) {
  switch (reason) {
    case v1::ContactEvent::REASON_PARTED:
      return "parted";
    case v1::ContactEvent::REASON_LEFT:
      return "left";
    case v1::ContactEvent::REASON_SHUTDOWN:
      return "shutdown";
    case v1::ContactEvent::REASON_RESTART:
      return "restart";
    default:
      return "unknown";
  }
}

const char* toString(v1::Verdict verdict) {
  switch (verdict) {
    case v1::VERDICT_SEPARATED:
      return "separated";
    case v1::VERDICT_TOUCHING:
      return "touching";
    case v1::VERDICT_PENETRATING:
      return "penetrating";
    default:
      return "unknown";
  }
}

const char* toString(v1::Feature feature) {
  switch (feature) {
    case v1::FEATURE_VERTEX:
      return "vertex";
    case v1::FEATURE_EDGE:
      return "edge";
    case v1::FEATURE_FACE:
      return "face";
    default:
      return "unknown";
  }
}

const char* toString(v1::Notice::Kind kind) {
  switch (kind) {
    case v1::Notice::KIND_ARRIVED:
      return "arrived";
    case v1::Notice::KIND_BLOCKED:
      return "blocked";
    case v1::Notice::KIND_REFUSED:
      return "refused";
    case v1::Notice::KIND_LEFT:
      return "left";
    case v1::Notice::KIND_SPAWNED:
      return "spawned";
    case v1::Notice::KIND_DONE:
      return "done";
    case v1::Notice::KIND_CAPTURE:
      return "capture";
    case v1::Notice::KIND_DROPPED:
      return "dropped";
    default:
      return "other";
  }
}

const char* toString(v1::ContactEvent::Phase phase) {
  switch (phase) {
    case v1::ContactEvent::PHASE_BEGIN:
      return "begin";
    case v1::ContactEvent::PHASE_MIN:
      return "min";
    case v1::ContactEvent::PHASE_END:
      return "end";
    default:
      return "unknown";
  }
}

}  // namespace enfilade::server
