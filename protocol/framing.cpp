#include "protocol/framing.hpp"

#include <google/protobuf/message_lite.h>
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

namespace enfilade::protocol {
namespace {

constexpr std::size_t kLengthBytes = 4;

std::uint32_t readLittleEndian(const std::uint8_t* bytes) {
  return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8 |
         static_cast<std::uint32_t>(bytes[2]) << 16 | static_cast<std::uint32_t>(bytes[3]) << 24;
}

void appendLittleEndian(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) {
    bytes.push_back(static_cast<std::uint8_t>(value >> shift & 0xFFu));
  }
}

void appendVarint(std::vector<std::uint8_t>& bytes, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<std::uint8_t>(value | 0x80));
  bytes.push_back(static_cast<std::uint8_t>(value));
}

/// Formats bytes as hexadecimal digits and, if all are printable, also as text.
std::string formatBytes(std::span<const std::uint8_t> bytes) {
  static constexpr char digits[] = "0123456789abcdef";
  std::string hex, text;
  for (const std::uint8_t byte : bytes) {
    hex += digits[byte >> 4];
    hex += digits[byte & 15];
    if (byte >= 0x20 && byte < 0x7F) text += static_cast<char>(byte);
  }
  return text.size() == bytes.size() ? hex + " (\"" + text + "\")" : hex;
}

}  // namespace

int parseMajorVersion(std::string_view version) {
  int major = -1;
  const char* end = version.data() + version.size();
  const auto [dot, problem] = std::from_chars(version.data(), end, major);
  return problem == std::errc{} && dot != end && *dot == '.' ? major : -1;
}

Decoder::Decoder(const FramingLimits& limits, Expect expect)
    : limits_(limits), magicSeen_(expect == Expect::messages) {}

std::optional<Message> Decoder::next(std::span<const std::uint8_t>& bytes) {
  if (error_) return std::nullopt;
  if (!magicSeen_ && !readMagic(bytes)) return std::nullopt;
  if (!readLengths(bytes)) return std::nullopt;
  if (!readPart(bytes, message_.header, headerLength_)) return std::nullopt;
  if (!readPart(bytes, message_.attachment, attachmentLength_)) return std::nullopt;
  prefixLength_ = 0;
  return std::exchange(message_, Message{});
}

std::size_t Decoder::bytesHeld() const {
  return message_.header.capacity() + message_.attachment.capacity();
}

/// Fills prefix_ up to `wanted` bytes. Returns false if more bytes are needed.
bool Decoder::readPrefix(std::span<const std::uint8_t>& bytes, std::size_t wanted) {
  const std::size_t count = std::min(wanted - prefixLength_, bytes.size());
  if (count > 0) std::memcpy(prefix_.data() + prefixLength_, bytes.data(), count);
  prefixLength_ += count;
  offset_ += count;
  bytes = bytes.subspan(count);
  return prefixLength_ == wanted;
}

bool Decoder::readMagic(std::span<const std::uint8_t>& bytes) {
  const bool whole = readPrefix(bytes, kMagic.size());
  // One wrong byte is enough, so that a sender of garbage fails without further bytes.
  if (!std::equal(prefix_.begin(), prefix_.begin() + static_cast<std::ptrdiff_t>(prefixLength_),
                  kMagic.begin())) {
    constexpr std::uint8_t kTlsHandshake = 0x16;
    fail(FramingError::Code::badMagic, 0,
         "the stream begins with " + formatBytes({prefix_.data(), prefixLength_}) + " instead of " +
             formatBytes(kMagic) +
             (prefix_[0] == kTlsHandshake ? "; is that TLS? A proxy in front has to remove it"
                                          : ""));
    return false;
  }
  if (!whole) return false;
  magicSeen_ = true;
  prefixLength_ = 0;
  return true;
}

bool Decoder::readLengths(std::span<const std::uint8_t>& bytes) {
  constexpr std::size_t both = 2 * kLengthBytes;
  if (prefixLength_ == both) return true;
  if (!readPrefix(bytes, both)) return false;
  const std::uint64_t start = offset_ - both;
  const std::uint32_t total = readLittleEndian(prefix_.data());
  headerLength_ = readLittleEndian(prefix_.data() + kLengthBytes);
  if (total > limits_.total) {
    fail(FramingError::Code::tooLarge, start,
         "a message of " + std::to_string(total) + " bytes exceeds the limit of " +
             std::to_string(limits_.total));
  } else if (headerLength_ > limits_.header) {
    fail(FramingError::Code::tooLarge, start + kLengthBytes,
         "a header of " + std::to_string(headerLength_) + " bytes exceeds the limit of " +
             std::to_string(limits_.header));
  } else if (total < kLengthBytes || headerLength_ > total - kLengthBytes) {
    fail(FramingError::Code::badLength, start,
         "a header of " + std::to_string(headerLength_) + " bytes does not fit into a message of " +
             std::to_string(total));
  } else {
    attachmentLength_ = total - static_cast<std::uint32_t>(kLengthBytes) - headerLength_;
  }
  return !error_;
}

/// Appends to `part` until it has `wanted` bytes. Returns false if more bytes are needed. Memory
/// grows with the received bytes, not with the claimed length.
bool Decoder::readPart(std::span<const std::uint8_t>& bytes, std::vector<std::uint8_t>& part,
                       std::size_t wanted) {
  const std::size_t count = std::min(wanted - part.size(), bytes.size());
  if (part.size() + count > part.capacity()) {
    part.reserve(std::min(wanted, std::max(2 * part.capacity(), part.size() + count)));
  }
  const auto taken = bytes.first(count);
  part.insert(part.end(), taken.begin(), taken.end());
  offset_ += count;
  bytes = bytes.subspan(count);
  return part.size() == wanted;
}

void Decoder::fail(FramingError::Code code, std::uint64_t offset, std::string reason) {
  error_ = FramingError{code, std::move(reason), offset};
  message_ = Message{};
}

bool parseHeader(std::span<const std::uint8_t> header, google::protobuf::MessageLite& into) {
  // Applies to the whole process, because libprotobuf has no other switch.
  [[maybe_unused]] static const auto silenced = google::protobuf::SetLogHandler(nullptr);
  return header.size() <= std::numeric_limits<std::int32_t>::max() &&
         into.ParseFromArray(header.data(), static_cast<int>(header.size()));
}

std::uint32_t readHeaderLength(std::span<const std::uint8_t> encoded) {
  static_assert(kPrefixBytes == 2 * kLengthBytes);
  return readLittleEndian(encoded.data() + kLengthBytes);
}

std::vector<std::uint8_t> encode(const google::protobuf::MessageLite& header,
                                 std::span<const std::uint8_t> attachment) {
  std::vector<std::uint8_t> bytes = encodeHead(header, attachment.size());
  bytes.insert(bytes.end(), attachment.begin(), attachment.end());
  return bytes;
}

std::vector<std::uint8_t> encodeHead(const google::protobuf::MessageLite& header,
                                     std::size_t attachmentLength) {
  const std::size_t headerLength = header.ByteSizeLong();
  const std::size_t total = kLengthBytes + headerLength + attachmentLength;
  // Protobuf's own limit is 2 GiB.
  if (headerLength > std::numeric_limits<std::int32_t>::max() ||
      total > std::numeric_limits<std::uint32_t>::max()) {
    throw std::length_error("a message of " + std::to_string(total) +
                            " bytes does not fit into its length field");
  }
  std::vector<std::uint8_t> bytes;
  bytes.reserve(2 * kLengthBytes + headerLength);
  appendLittleEndian(bytes, static_cast<std::uint32_t>(total));
  appendLittleEndian(bytes, static_cast<std::uint32_t>(headerLength));
  bytes.resize(2 * kLengthBytes + headerLength);
  header.SerializeWithCachedSizesToArray(bytes.data() + 2 * kLengthBytes);
  return bytes;
}

std::vector<std::uint8_t> encodeSplicedHead(std::uint32_t field, std::string_view first,
                                            std::size_t secondLength) {
  constexpr std::uint32_t kLengthDelimited = 2;   // protobuf's wire type of messages
  constexpr std::size_t kMaxFieldHeadBytes = 20;  // tag and length
  std::vector<std::uint8_t> fieldHead;
  fieldHead.reserve(kMaxFieldHeadBytes);
  appendVarint(fieldHead, field << 3 | kLengthDelimited);
  appendVarint(fieldHead, first.size() + secondLength);
  const std::size_t headerLength = fieldHead.size() + first.size() + secondLength;
  if (headerLength > std::numeric_limits<std::int32_t>::max()) {
    throw std::length_error("a message of " + std::to_string(headerLength) +
                            " bytes exceeds the limit of protobuf");
  }
  std::vector<std::uint8_t> bytes;
  bytes.reserve(2 * kLengthBytes + fieldHead.size() + first.size());
  appendLittleEndian(bytes, static_cast<std::uint32_t>(kLengthBytes + headerLength));
  appendLittleEndian(bytes, static_cast<std::uint32_t>(headerLength));
  bytes.insert(bytes.end(), fieldHead.begin(), fieldHead.end());
  bytes.insert(bytes.end(), first.begin(), first.end());
  return bytes;
}

}  // namespace enfilade::protocol
