#include "server/messages/decode_message.hpp"

#include <span>
#include <utility>

#include "protocol/framing.hpp"

namespace enfilade::server {

std::optional<DecodedMessage> decodeMessage(const EncodedMessage& encoded) {
  protocol::Decoder decoder(protocol::kClientLimits, protocol::Decoder::Expect::messages);
  std::span<const std::uint8_t> bytes(*encoded.head);
  auto framed = decoder.next(bytes);
  if (!framed && encoded.body) {
    bytes = *encoded.body;
    framed = decoder.next(bytes);
  }
  DecodedMessage decoded;
  if (!framed || !protocol::parseHeader(framed->header, decoded.message)) return std::nullopt;
  decoded.attachment = std::move(framed->attachment);
  return decoded;
}

}  // namespace enfilade::server
