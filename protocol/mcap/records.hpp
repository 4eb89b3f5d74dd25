// Encoding of MCAP files (https://mcap.dev/spec, version 0): little-endian numbers, strings and
// arrays with a 32-bit length prefix, records with an opcode and a 64-bit length.
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

/// Size of a record's opcode and length, bytes.
inline constexpr std::size_t kRecordHeadBytes = 9;

/// Maximum chunk size, compressed or not. Enfilade writes smaller chunks; larger ones are rejected.
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{64} << 20;

/// An invalid recording. The text has the file, the reason and, if known, the byte position.
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

/// Appends one record.
inline void putRecord(std::string& into, Opcode opcode, std::string_view content) {
  putNumber(into, static_cast<std::uint8_t>(opcode));
  putNumber(into, static_cast<std::uint64_t>(content.size()));
  into.append(content);
}

/// Reads consecutive numbers and strings. Throws std::out_of_range at the end of the bytes.
class Fields {
 public:
  explicit Fields(std::string_view bytes) : remaining_(bytes) {}

  template <class Number>
  Number number() {
    const std::string_view bytes = takeBytes(sizeof(Number));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(Number); ++i)
      value |= std::uint64_t{static_cast<unsigned char>(bytes[i])} << (8 * i);
    return static_cast<Number>(value);
  }
  std::string_view string() { return takeBytes(number<std::uint32_t>()); }
  std::string_view takeBytes(std::uint64_t bytes) {
    if (bytes > remaining_.size()) throw std::out_of_range("a field extends beyond its record");
    const std::string_view taken = remaining_.substr(0, bytes);
    remaining_.remove_prefix(bytes);
    return taken;
  }
  std::string_view rest() { return takeBytes(remaining_.size()); }
  bool empty() const { return remaining_.empty(); }

 private:
  std::string_view remaining_;
};

}  // namespace enfilade::protocol::mcap
