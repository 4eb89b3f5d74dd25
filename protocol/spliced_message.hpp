// Messages for many clients: the shared part is serialised once, the part per client is appended.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace enfilade::protocol {

/// Encodes a header whose only field, number `field`, is a message in two serialised parts.
/// Protobuf merges messages by concatenating their bytes. The caller sends the second part after
/// the returned bytes. Throws std::length_error, as encode().
std::vector<std::uint8_t> encodeSplicedHead(std::uint32_t field, std::string_view first,
                                            std::size_t secondLength);

}  // namespace enfilade::protocol
