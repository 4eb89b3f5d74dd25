// How messages lie on a byte stream. Each side first sends four bytes of magic, then messages:
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

/// The number before the first dot of a semantic version; -1 when there is none.
int majorOf(std::string_view version);

/// What a receiver takes. A message above it is refused before memory is spent on it.
struct FramingLimits {
  std::uint32_t total = 0;   ///< bytes, the value of the field `total`
  std::uint32_t header = 0;  ///< bytes
};
inline constexpr FramingLimits kServerTakes{1u << 20, 1u << 20};  ///< from a client
inline constexpr FramingLimits kClientTakes{1u << 28, 1u << 24};  ///< from a server: pictures

struct Message {
  std::vector<std::uint8_t> header;
  std::vector<std::uint8_t> attachment;
};

struct FramingError {
  enum class Code : std::uint8_t {
    badMagic,
    tooLarge,  ///< above FramingLimits
    badLength  ///< the two lengths contradict each other
  };
  Code code = Code::badMagic;
  std::string reason;        ///< one sentence: what was met and what was expected
  std::uint64_t offset = 0;  ///< bytes from the start of the stream to what is wrong
};

/// Takes a stream in pieces of any size and gives its messages. Holds at most one unfinished
/// message, and no more memory than the bytes of it that came, doubled at most.
class Decoder {
 public:
  enum class Expect : std::uint8_t { magicFirst, messages };
  explicit Decoder(const FramingLimits& limits, Expect expect = Expect::magicFirst);

  /// Takes bytes from the front of `bytes` until a message is whole, and returns it. nullopt: all
  /// bytes were taken and more are needed, or error() holds. After an error nothing is taken.
  std::optional<Message> next(std::span<const std::uint8_t>& bytes);

  const std::optional<FramingError>& error() const { return error_; }
  bool magicSeen() const { return magicSeen_; }
  /// The stream may end here: no message is half-way.
  bool betweenMessages() const { return magicSeen_ && !error_ && prefixLength_ == 0; }
  std::uint64_t offset() const { return offset_; }  ///< bytes taken so far
  std::size_t bytesHeld() const;                    ///< capacity held for the message

 private:
  bool takePrefix(std::span<const std::uint8_t>& bytes, std::size_t wanted);
  bool takeMagic(std::span<const std::uint8_t>& bytes);
  bool takeLengths(std::span<const std::uint8_t>& bytes);
  bool takePart(std::span<const std::uint8_t>& bytes, std::vector<std::uint8_t>& part,
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

/// One message as it goes over the wire, without magic. Throws std::length_error when it does not
/// fit into `total`.
std::vector<std::uint8_t> encode(const google::protobuf::MessageLite& header,
                                 std::span<const std::uint8_t> attachment = {});
/// The same without the attachment, whose bytes go out behind it.
std::vector<std::uint8_t> encodeHead(const google::protobuf::MessageLite& header,
                                     std::size_t attachmentLength);

/// Reads a message's header; false when it is none. Unlike ParseFromArray() it writes nothing to
/// stderr, which a hostile peer could fill.
bool parse(std::span<const std::uint8_t> header, google::protobuf::MessageLite& into);

}  // namespace enfilade::protocol
