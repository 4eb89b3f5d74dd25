#include "protocol/spliced_message.hpp"

#include <limits>
#include <stdexcept>
#include <string>

#include "protocol/framing.hpp"

namespace enfilade::protocol {
namespace {

void appendVarint(std::vector<std::uint8_t>& bytes, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<std::uint8_t>(value | 0x80));
  bytes.push_back(static_cast<std::uint8_t>(value));
}

}  // namespace

std::vector<std::uint8_t> encodeSplicedHead(std::uint32_t field, std::string_view first,
                                            std::size_t secondLength) {
  constexpr std::size_t kLength = 4;             // bytes of each of the two lengths in framing.hpp
  constexpr std::uint32_t kLengthDelimited = 2;  // protobuf's wire type of messages
  constexpr std::size_t kMaxHeadBytes = 20;      // bytes: tag and length
  std::vector<std::uint8_t> head;
  head.reserve(kMaxHeadBytes);
  appendVarint(head, field << 3 | kLengthDelimited);
  appendVarint(head, first.size() + secondLength);
  const std::size_t headerLength = head.size() + first.size() + secondLength;
  if (headerLength > std::numeric_limits<std::int32_t>::max()) {
    throw std::length_error("a message of " + std::to_string(headerLength) +
                            " bytes exceeds the limit of protobuf");
  }
  std::vector<std::uint8_t> bytes;
  bytes.reserve(2 * kLength + head.size() + first.size());
  appendLittleEndian(bytes, static_cast<std::uint32_t>(kLength + headerLength));
  appendLittleEndian(bytes, static_cast<std::uint32_t>(headerLength));
  bytes.insert(bytes.end(), head.begin(), head.end());
  bytes.insert(bytes.end(), first.begin(), first.end());
  return bytes;
}

}  // namespace enfilade::protocol
