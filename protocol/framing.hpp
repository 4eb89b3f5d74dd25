// Framing of messages on a byte stream. Each side first sends four magic bytes, then messages:
//
//   u32 total | u32 headerLength | header (protobuf) | attachment (raw bytes, may be empty)
//
// Both numbers are little-endian; `total` counts everything after itself, `headerLength` the header
// alone, so 4 + headerLength <= total.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace google::protobuf {
class MessageLite;
}

namespace enfilade::protocol {

inline constexpr std::array<std::uint8_t, 4> kMagic{'E', 'N', 'F', '1'};

/// Semantic version of enfilade.proto and of the framing.
inline constexpr const char* kVersion = "1.0.0";
inline constexpr int kMajorVersion = 1;

/// Parses the major number of a semantic version; -1 if invalid.
int parseMajorVersion(std::string_view version);

/// Size limits of a receiver. A larger message is refused before memory is allocated for it.
struct FramingLimits {
  std::uint32_t total = 0;   ///< bytes, the value of the field `total`
  std::uint32_t header = 0;  ///< bytes
};
inline constexpr FramingLimits kServerLimits{1u << 20, 1u << 20};  ///< from a client
inline constexpr FramingLimits kClientLimits{1u << 28, 1u << 24};  ///< from a server: includes
                                                                   ///< pictures

struct Message {
  std::vector<std::uint8_t> header;
  std::vector<std::uint8_t> attachment;
};

struct FramingError {
  enum class Code : std::uint8_t {
    badMagic,
    tooLarge,  ///< exceeds FramingLimits
    badLength  ///< the two lengths contradict each other
  };
  Code code = Code::badMagic;
  std::string reason;        ///< one sentence: received and expected bytes
  std::uint64_t offset = 0;  ///< position of the error in the stream, bytes
};

/// Decodes messages from a stream in pieces of any size. Holds at most one incomplete message, and
/// at most twice the memory of its received bytes.
class Decoder {
 public:
  enum class Expect : std::uint8_t { magicFirst, messages };
  explicit Decoder(const FramingLimits& limits, Expect expect = Expect::magicFirst);

  /// Consumes bytes from the front of `bytes` until a message is complete, and returns it.
  /// nullopt: all bytes were consumed, or error() is set. After an error no bytes are consumed.
  std::optional<Message> next(std::span<const std::uint8_t>& bytes);

  const std::optional<FramingError>& error() const { return error_; }
  bool magicSeen() const { return magicSeen_; }
  /// True if the stream may end here, between two messages.
  bool betweenMessages() const { return magicSeen_ && !error_ && prefixLength_ == 0; }
  std::uint64_t offset() const { return offset_; }  ///< bytes consumed so far
  std::size_t bytesHeld() const;                    ///< capacity allocated for the message

 private:
  bool readPrefix(std::span<const std::uint8_t>& bytes, std::size_t wanted);
  bool readMagic(std::span<const std::uint8_t>& bytes);
  bool readLengths(std::span<const std::uint8_t>& bytes);
  bool readPart(std::span<const std::uint8_t>& bytes, std::vector<std::uint8_t>& part,
                std::size_t wanted);
  void fail(FramingError::Code code, std::uint64_t offset, std::string reason);

  FramingLimits limits_;
  bool magicSeen_ = false;
  std::array<std::uint8_t, 8> prefix_{};  ///< the magic, then the two lengths
  std::size_t prefixLength_ = 0;
  std::uint32_t headerLength_ = 0;
  std::uint32_t attachmentLength_ = 0;
  Message message_;
  std::uint64_t offset_ = 0;
  std::optional<FramingError> error_;
};

/// Encodes one message, without magic bytes. Throws std::length_error if it does not fit into
/// `total`.
std::vector<std::uint8_t> encode(const google::protobuf::MessageLite& header,
                                 std::span<const std::uint8_t> attachment = {});
/// The same without the attachment, whose bytes the caller sends after it.
std::vector<std::uint8_t> encodeHead(const google::protobuf::MessageLite& header,
                                     std::size_t attachmentLength);
/// Encodes a header whose only field, number `field`, is a message in two serialized parts: one per
/// client and one that all share. Protobuf merges messages by concatenating their bytes. The caller
/// sends the second part after the returned bytes. Throws std::length_error, as encode().
std::vector<std::uint8_t> encodeSplicedHead(std::uint32_t field, std::string_view first,
                                            std::size_t secondLength);

/// Bytes of an encoded message before its header.
inline constexpr std::size_t kPrefixBytes = 8;
/// The length of the header, from the prefix of an encoded message.
std::uint32_t readHeaderLength(std::span<const std::uint8_t> encoded);

/// Parses a message header; false if invalid. Unlike ParseFromArray() it does not write to stderr,
/// which a hostile peer could flood.
bool parseHeader(std::span<const std::uint8_t> header, google::protobuf::MessageLite& into);

}  // namespace enfilade::protocol
