// One message for many: what they share is serialized once, what differs is joined to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace enfilade::protocol {

/// As encode(), of a header whose only field is the message number `field`, given as two serialized
/// parts: protobuf joins messages by joining their bytes. The second part goes out behind what is
/// returned. Throws std::length_error, as encode().
std::vector<std::uint8_t> encodeHeadOfJoined(std::uint32_t field, std::string_view first,
                                             std::size_t secondLength);

}  // namespace enfilade::protocol
