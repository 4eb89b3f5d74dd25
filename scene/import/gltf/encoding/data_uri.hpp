// Data URIs (RFC 2397) of glTF buffers. Private to the import.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace enfilade::scene {

/// The bytes of a data URI, in Base64 (RFC 4648, also its alphabet for URLs) or percent-encoded.
/// Line ends are skipped. Sets `fault` at any other character that is not Base64.
std::string decodeDataUri(std::string_view uri, std::string& fault);

/// Whether assimp decodes the URI right: Base64 of at least `size` bytes and nothing else.
bool isPlainDataUri(std::string_view uri, std::size_t size);

}  // namespace enfilade::scene
