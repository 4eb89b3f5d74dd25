// Finds enum values that this version of the protocol does not define. proto3 keeps them, so that a
// request of a newer client would silently mean something else.
#pragma once

#include <string>

namespace google::protobuf {
class Message;
}

namespace enfilade::protocol {

/// The path and the value of the first unknown enum value in the message, such as
/// "cannot_touch.assume = 7"; "": all are known.
std::string findUnknownEnum(const google::protobuf::Message& message);

}  // namespace enfilade::protocol
