// Decodes a message that this process encoded for a client: for sessions that translate the
// protocol into another one.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "server/messages/outgoing_queue.hpp"

namespace enfilade::server {

struct DecodedMessage {
  v1::ServerMessage message;
  std::vector<std::uint8_t> attachment;
};
/// nullopt: not a message of the protocol, as magic bytes.
std::optional<DecodedMessage> decodeMessage(const EncodedMessage& encoded);

}  // namespace enfilade::server
