// The bytes of MCAP files (https://mcap.dev/spec, version 0): little-endian numbers, strings and
// arrays with a 32-bit length before them, records with an opcode and a 64-bit length.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

namespace enfilade::protocol::mcap {

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  messageIndex = 0x07,
  chunkIndex = 0x08,
  statistics = 0x0B,
  metadata = 0x0C,
  metadataIndex = 0x0D,
  dataEnd = 0x0F
};

/// A record's opcode and length.
inline constexpr std::size_t kRecordHead = 9;

/// No chunk of ours is larger, packed or not; a file that claims more is not read.
inline constexpr std::uint64_t kMostChunkBytes = std::uint64_t{64} << 20;

/// Names the file and what is wrong, with the byte where it was met when there is one.
struct RecordingError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

template <class Number>
void putNumber(std::string& into, Number number) {
  for (std::size_t i = 0; i < sizeof(Number); ++i)
    into.push_back(static_cast<char>((static_cast<std::uint64_t>(number) >> (8 * i)) & 0xFF));
}

inline void putString(std::string& into, std::string_view text) {
  putNumber(into, static_cast<std::uint32_t>(text.size()));
  into.append(text);
}

/// Appends a whole record.
inline void putRecord(std::string& into, Opcode opcode, std::string_view content) {
  putNumber(into, static_cast<std::uint8_t>(opcode));
  putNumber(into, static_cast<std::uint64_t>(content.size()));
  into.append(content);
}

/// Reads numbers and strings one after another; throws std::out_of_range at the end of the bytes.
class Fields {
 public:
  explicit Fields(std::string_view bytes) : left_(bytes) {}

  template <class Number>
  Number number() {
    const std::string_view bytes = take(sizeof(Number));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(Number); ++i)
      value |= std::uint64_t{static_cast<unsigned char>(bytes[i])} << (8 * i);
    return static_cast<Number>(value);
  }
  std::string_view string() { return take(number<std::uint32_t>()); }
  std::string_view take(std::uint64_t bytes) {
    if (bytes > left_.size()) throw std::out_of_range("a field ends after its record");
    const std::string_view taken = left_.substr(0, bytes);
    left_.remove_prefix(bytes);
    return taken;
  }
  std::string_view rest() { return take(left_.size()); }
  bool empty() const { return left_.empty(); }

 private:
  std::string_view left_;
};

}  // namespace enfilade::protocol::mcap
