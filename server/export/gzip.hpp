// Compression for HTTP's Content-Encoding: gzip (RFC 1952).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade::server {

/// The bytes as a gzip file without name and time; equal bytes give an equal file. Throws
/// std::runtime_error.
std::vector<std::uint8_t> gzip(std::span<const std::uint8_t> bytes);

}  // namespace enfilade::server
