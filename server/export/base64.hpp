// Base64 (RFC 4648), for data in JSON and HTML.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace enfilade::server {

/// With padding and without line breaks.
std::string encodeBase64(std::span<const std::uint8_t> bytes);

}  // namespace enfilade::server
