// Data URIs (RFC 2397) of glTF buffers. Private to the import.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace enfilade::scene {

/// Whether a URI is one, in small or capital letters (RFC 3986, 3.1).
bool isDataUri(std::string_view uri);

/// The bytes of a data URI, in Base64 (RFC 4648, also its alphabet for URLs) or percent-encoded.
/// Line ends are skipped. Sets `fault` at any other character that is not Base64.
std::string decodeDataUri(std::string_view uri, std::string& fault);

/// The URI with the part before its data in small letters, as assimp expects it.
std::string lowerDataUri(const std::string& uri);

/// Whether assimp decodes the URI right: Base64 of at least `size` bytes and nothing else.
bool isPlainDataUri(std::string_view uri, std::size_t size);

}  // namespace enfilade::scene
