// Fuzz target of message framing: the first byte selects the size of the pieces, the rest is the
// stream.
#include <vector>

#include "protocol/enfilade.pb.h"
#include "protocol/framing.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace enfilade::fuzz {
namespace {

using protocol::Decoder;
using protocol::Message;
using Bytes = std::span<const std::uint8_t>;

struct Decoded {
  std::vector<Message> messages;
  std::uint64_t offset = 0;
  bool failed = false;
};

Decoded decodeAll(Bytes stream, Decoder::Expect expect, std::size_t piece) {
  Decoder decoder(protocol::kServerLimits, expect);
  Decoded all;
  while (!stream.empty() && !decoder.error()) {
    Bytes some = stream.first(std::min(piece, stream.size()));
    stream = stream.subspan(some.size());
    while (auto message = decoder.next(some)) all.messages.push_back(std::move(*message));
    require(some.empty() || decoder.error(), "the decoder takes all bytes or fails");
    require(decoder.bytesHeld() <= 2 * decoder.offset() + 64, "memory follows the received bytes");
  }
  all.offset = decoder.offset();
  all.failed = decoder.error().has_value();
  return all;
}

bool areSame(const std::vector<Message>& a, const std::vector<Message>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Message& x, const Message& y) {
    return x.header == y.header && x.attachment == y.attachment;
  });
}

template <typename Envelope>
void tryParsing(const Message& message) {
  Envelope envelope;
  if (!protocol::parseHeader(message.header, envelope)) return;
  const std::vector<std::uint8_t> again = protocol::encode(envelope, message.attachment);
  Decoder decoder({1u << 30, 1u << 30}, Decoder::Expect::messages);
  Bytes bytes(again);
  const auto back = decoder.next(bytes);
  require(back && bytes.empty(), "an encoded message can be decoded");
  require(back->attachment == message.attachment, "attachments are unchanged");
}

}  // namespace

void tryBytes(Bytes bytes) {
  if (bytes.empty()) return;
  const auto expect = bytes[0] & 1 ? Decoder::Expect::magicFirst : Decoder::Expect::messages;
  const std::size_t piece = std::size_t{1} + (bytes[0] >> 1);
  const Bytes stream = bytes.subspan(1);
  const Decoded whole = decodeAll(stream, expect, stream.size() + 1);
  const Decoded cut = decodeAll(stream, expect, piece);
  require(areSame(whole.messages, cut.messages), "messages do not depend on how the stream is cut");
  require(whole.failed == cut.failed, "errors do not depend on how the stream is cut");
  require(whole.failed || whole.offset == stream.size(), "all bytes are counted");
  for (const Message& message : whole.messages) {
    tryParsing<v1::ClientMessage>(message);
    tryParsing<v1::ServerMessage>(message);
  }
}

}  // namespace enfilade::fuzz
