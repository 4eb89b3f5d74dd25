#include "protocol/framing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "protocol/enfilade.pb.h"

namespace enfilade::protocol {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr FramingLimits kSmall{4096, 1024};

v1::ClientMessage makeWalkMessage(int waypoints) {
  v1::ClientMessage message;
  message.set_request_id(7);
  message.mutable_command()->set_avatar("ann");
  for (int i = 0; i < waypoints; ++i) {
    message.mutable_command()->mutable_walk()->add_along()->set_x(i + 0.5);
  }
  return message;
}

void append(Bytes& stream, const Bytes& more) {
  stream.insert(stream.end(), more.begin(), more.end());
}

/// Magic, and three messages: with an attachment, without one, and with an empty header.
Bytes makeSampleStream() {
  Bytes stream(kMagic.begin(), kMagic.end());
  append(stream, encode(makeWalkMessage(3), Bytes{1, 2, 3, 4, 5}));
  append(stream, encode(makeWalkMessage(1)));
  append(stream, encode(v1::ClientMessage{}, Bytes(300, 9)));
  return stream;
}

struct Outcome {
  std::vector<Message> messages;
  std::optional<FramingError> error;
  bool betweenMessages = false;
};

bool areSame(const Outcome& a, const Outcome& b) {
  const bool sameError =
      a.error.has_value() == b.error.has_value() &&
      (!a.error || (a.error->code == b.error->code && a.error->offset == b.error->offset));
  return sameError && a.betweenMessages == b.betweenMessages &&
         std::equal(a.messages.begin(), a.messages.end(), b.messages.begin(), b.messages.end(),
                    [](const Message& m, const Message& n) {
                      return m.header == n.header && m.attachment == n.attachment;
                    });
}

/// Feeds the stream in pieces of the sizes that `pieceSize()` returns.
template <typename PieceSize>
Outcome decodeInPieces(const Bytes& stream, const FramingLimits& limits, PieceSize pieceSize) {
  Decoder decoder(limits);
  Outcome outcome;
  std::span<const std::uint8_t> rest(stream);
  while (!rest.empty() && !decoder.error()) {
    auto piece = rest.first(std::min<std::size_t>(pieceSize(), rest.size()));
    rest = rest.subspan(piece.size());
    while (auto message = decoder.next(piece)) outcome.messages.push_back(std::move(*message));
    EXPECT_LE(decoder.bytesHeld(), limits.total);
  }
  outcome.error = decoder.error();
  outcome.betweenMessages = decoder.betweenMessages();
  return outcome;
}

Outcome decodeAtOnce(const Bytes& stream, const FramingLimits& limits) {
  return decodeInPieces(stream, limits, [&] { return stream.size(); });
}

std::uint32_t readU32At(const Bytes& bytes, std::size_t place) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | bytes[place + i];
  return value;
}

/// Reference implementation: decodes the whole stream at once.
Outcome decodeWholeStream(const Bytes& stream, const FramingLimits& limits) {
  using Code = FramingError::Code;
  Outcome outcome;
  const std::size_t magic = std::min(stream.size(), kMagic.size());
  if (!std::equal(kMagic.begin(), kMagic.begin() + magic, stream.begin())) {
    outcome.error = FramingError{Code::badMagic, "", 0};
    return outcome;
  }
  if (stream.size() < kMagic.size()) return outcome;
  std::size_t at = kMagic.size();
  while (at + 8 <= stream.size()) {
    const std::size_t total = readU32At(stream, at), header = readU32At(stream, at + 4);
    if (total > limits.total)
      outcome.error = FramingError{Code::tooLarge, "", at};
    else if (header > limits.header)
      outcome.error = FramingError{Code::tooLarge, "", at + 4};
    else if (4 + header > total)
      outcome.error = FramingError{Code::badLength, "", at};
    if (outcome.error) return outcome;
    if (at + 4 + total > stream.size()) return outcome;
    const auto start = stream.begin() + static_cast<std::ptrdiff_t>(at + 8);
    const auto middle = start + static_cast<std::ptrdiff_t>(header);
    const auto end = stream.begin() + static_cast<std::ptrdiff_t>(at + 4 + total);
    outcome.messages.push_back({Bytes(start, middle), Bytes(middle, end)});
    at += 4 + total;
  }
  outcome.betweenMessages = at == stream.size();
  return outcome;
}

TEST(Framing, EncodedMessagesAreDecoded) {
  const Outcome outcome = decodeAtOnce(makeSampleStream(), kSmall);
  ASSERT_FALSE(outcome.error);
  ASSERT_EQ(outcome.messages.size(), 3u);
  EXPECT_TRUE(outcome.betweenMessages);
  v1::ClientMessage first;
  ASSERT_TRUE(parseHeader(outcome.messages[0].header, first));
  EXPECT_EQ(first.SerializeAsString(), makeWalkMessage(3).SerializeAsString());
  EXPECT_EQ(outcome.messages[0].attachment, (Bytes{1, 2, 3, 4, 5}));
  EXPECT_TRUE(outcome.messages[1].attachment.empty());
  EXPECT_TRUE(outcome.messages[2].header.empty());
  EXPECT_EQ(outcome.messages[2].attachment, Bytes(300, 9));
}

TEST(Framing, WhereTheStreamIsSplitDoesNotMatter) {
  const Bytes stream = makeSampleStream();
  const Outcome whole = decodeAtOnce(stream, kSmall);
  for (std::size_t first = 1; first < stream.size(); ++first) {
    bool firstPiece = true;
    const Outcome split = decodeInPieces(
        stream, kSmall, [&] { return std::exchange(firstPiece, false) ? first : stream.size(); });
    EXPECT_TRUE(areSame(split, whole)) << "split after byte " << first;
  }
  EXPECT_TRUE(areSame(decodeInPieces(stream, kSmall, [] { return 1; }), whole));
}

TEST(Framing, ATruncatedStreamGivesItsWholeMessagesAndNoError) {
  const Bytes stream = makeSampleStream();
  std::size_t between = 0;
  for (std::size_t length = 0; length <= stream.size(); ++length) {
    const Bytes cut(stream.begin(), stream.begin() + static_cast<std::ptrdiff_t>(length));
    const Outcome outcome = decodeAtOnce(cut, kSmall);
    EXPECT_FALSE(outcome.error) << length;
    EXPECT_TRUE(areSame(outcome, decodeWholeStream(cut, kSmall))) << length;
    between += outcome.betweenMessages ? 1 : 0;
  }
  EXPECT_EQ(between, 4u);  // after the magic and after each message
}

TEST(Framing, LengthsAreLittleEndianAndTotalCountsTheFollowingBytes) {
  const Bytes bytes = encode(v1::ClientMessage{}, Bytes(0x0102, 1));
  EXPECT_EQ(Bytes(bytes.begin(), bytes.begin() + 8), (Bytes{6, 1, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bytes.size(), 4u + 0x0106u);
}

Outcome decodeLengths(std::uint32_t total, std::uint32_t header) {
  Bytes stream(kMagic.begin(), kMagic.end());
  for (const std::uint32_t value : {total, header}) {
    for (int shift = 0; shift < 32; shift += 8) {
      stream.push_back(static_cast<std::uint8_t>(value >> shift & 0xFFu));
    }
  }
  return decodeAtOnce(stream, kSmall);
}

TEST(Framing, AMessageAboveTheLimitIsRefusedByItsLengthAlone) {
  EXPECT_FALSE(decodeLengths(4096, 0).error);
  for (const std::uint32_t total : {4097u, 0x8000'0000u, 0xFFFF'FFFFu}) {
    const Outcome outcome = decodeLengths(total, 0);
    ASSERT_TRUE(outcome.error);
    EXPECT_EQ(outcome.error->code, FramingError::Code::tooLarge);
    EXPECT_EQ(outcome.error->offset, 4u);
    EXPECT_NE(outcome.error->reason.find(std::to_string(total)), std::string::npos);
    EXPECT_NE(outcome.error->reason.find("4096"), std::string::npos);
  }
}

TEST(Framing, AHeaderAboveTheLimitIsRefusedAtItsLength) {
  EXPECT_FALSE(decodeLengths(4000, 1024).error);
  const Outcome outcome = decodeLengths(4000, 1025);
  ASSERT_TRUE(outcome.error);
  EXPECT_EQ(outcome.error->code, FramingError::Code::tooLarge);
  EXPECT_EQ(outcome.error->offset, 8u);
}

TEST(Framing, AHeaderThatDoesNotFitIntoItsMessageIsRefused) {
  EXPECT_FALSE(decodeLengths(104, 100).error);
  for (const auto& [total, header] : {std::pair{103u, 100u}, {0u, 0u}, {3u, 0u}}) {
    const Outcome outcome = decodeLengths(total, header);
    ASSERT_TRUE(outcome.error) << total;
    EXPECT_EQ(outcome.error->code, FramingError::Code::badLength);
    EXPECT_EQ(outcome.error->offset, 4u);
  }
}

TEST(Framing, TheFirstWrongByteOfTheMagicIsEnough) {
  for (std::size_t wrong = 0; wrong < kMagic.size(); ++wrong) {
    Bytes stream(kMagic.begin(), kMagic.begin() + static_cast<std::ptrdiff_t>(wrong));
    EXPECT_FALSE(decodeAtOnce(stream, kSmall).error);
    stream.push_back(0);
    const Outcome outcome = decodeAtOnce(stream, kSmall);
    ASSERT_TRUE(outcome.error);
    EXPECT_EQ(outcome.error->code, FramingError::Code::badMagic);
  }
  const Outcome http = decodeAtOnce({'G', 'E', 'T', ' '}, kSmall);
  ASSERT_TRUE(http.error);
  EXPECT_NE(http.error->reason.find("GET "), std::string::npos);
}

TEST(Framing, AClaimedLengthAllocatesNothingBeforeItsBytesArrive) {
  Decoder decoder({1u << 30, 1u << 30}, Decoder::Expect::messages);
  const Bytes lengths{0, 0, 0, 0x20, 0, 0, 0, 0x10};  // half a gibibyte
  std::span<const std::uint8_t> piece(lengths);
  EXPECT_FALSE(decoder.next(piece));
  EXPECT_FALSE(decoder.error());
  EXPECT_EQ(decoder.bytesHeld(), 0u);
  const Bytes some(1000, 1);
  piece = some;
  EXPECT_FALSE(decoder.next(piece));
  EXPECT_LE(decoder.bytesHeld(), 2000u);
}

TEST(Framing, AfterAnErrorNothingIsAccepted) {
  Decoder decoder(kSmall);
  const Bytes stream{'X', 'Y'};
  std::span<const std::uint8_t> piece(stream);
  EXPECT_FALSE(decoder.next(piece));
  const auto left = piece.size();
  EXPECT_FALSE(decoder.next(piece));
  EXPECT_EQ(piece.size(), left);
  EXPECT_FALSE(decoder.betweenMessages());
}

/// Flips, cuts, repeats or overwrites a few bytes.
Bytes corruptStream(Bytes stream, std::mt19937& random) {
  const auto below = [&](std::size_t end) { return random() % end; };
  for (std::size_t count = 1 + below(3); count > 0 && !stream.empty(); --count) {
    const std::size_t at = below(stream.size());
    const auto place = stream.begin() + static_cast<std::ptrdiff_t>(at);
    switch (below(5)) {
      case 0:
        *place = static_cast<std::uint8_t>(random());
        break;
      case 1:
        *place ^= static_cast<std::uint8_t>(1u << below(8));
        break;
      case 2:
        stream.erase(place, stream.end());
        break;
      case 3:
        stream.erase(place);
        break;
      default:
        stream.insert(place, static_cast<std::uint8_t>(random()));
        break;
    }
  }
  return stream;
}

TEST(Framing, CorruptStreamsDecodeAsTheReferenceDecoderSays) {
  std::mt19937 random(20'000);
  const Bytes sound = makeSampleStream();
  constexpr int kStreams = 20'000;
  int errors = 0, messages = 0;
  for (int i = 0; i < kStreams; ++i) {
    const Bytes stream = corruptStream(sound, random);
    const Outcome expected = decodeWholeStream(stream, kSmall);
    const Outcome outcome =
        decodeInPieces(stream, kSmall, [&] { return std::size_t{1} + random() % 97; });
    ASSERT_TRUE(areSame(outcome, expected)) << "stream " << i;
    errors += outcome.error ? 1 : 0;
    messages += outcome.messages.size() == 3 ? 1 : 0;
    for (const Message& message : outcome.messages) {  // parsing them must not crash, either
      v1::ClientMessage parsed;
      static_cast<void>(parseHeader(message.header, parsed));
    }
  }
  // Neither all invalid nor all valid.
  EXPECT_GT(errors, kStreams / 20);
  EXPECT_LT(errors, kStreams * 19 / 20);
  EXPECT_GT(messages, kStreams / 20);
}

TEST(Framing, AMessageJoinedOfTwoPartsIsTheMessageOfBoth) {
  v1::TickEvents own, shared;
  own.set_sequence(300);
  shared.set_tick(7);
  for (int i = 0; i < 20; ++i) shared.add_notices()->set_text("the shared part is longer than 127");
  const std::string second = shared.SerializeAsString();
  auto bytes = encodeSplicedHead(v1::ServerMessage::kEventsFieldNumber, own.SerializeAsString(),
                                 second.size());
  bytes.insert(bytes.end(), second.begin(), second.end());
  v1::ServerMessage whole;
  *whole.mutable_events() = shared;
  whole.mutable_events()->set_sequence(300);
  Decoder decoder(kClientLimits, Decoder::Expect::messages);
  std::span<const std::uint8_t> unread(bytes);
  const auto message = decoder.next(unread);
  ASSERT_TRUE(message);
  v1::ServerMessage parsed;
  ASSERT_TRUE(parseHeader(message->header, parsed));
  EXPECT_EQ(parsed.SerializeAsString(), whole.SerializeAsString());
}

TEST(Version, TheMajorNumberPrecedesTheFirstDot) {
  EXPECT_EQ(parseMajorVersion(kVersion), kMajorVersion);
  EXPECT_EQ(parseMajorVersion("12.0.0-rc.1"), 12);
  for (const char* none : {"", ".", ".1", "1", "x.1", " 1.0", "1x.0", "99999999999.0"}) {
    EXPECT_EQ(parseMajorVersion(none), -1) << none;
  }
}

}  // namespace
}  // namespace enfilade::protocol
