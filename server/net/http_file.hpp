// Files over HTTP: content types, entity tags and conditions (RFC 9110, sections 8.8 and 13), and
// compression. No sockets.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace enfilade::server {

/// A file in memory with what its response says of it.
struct HttpFile {
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  std::string contentType;
  std::string tag;               ///< strong entity tag, without quotes
  bool isCompressed = false;     ///< `bytes` are gzip
  bool mayBeCompressed = false;  ///< other clients get other bytes
  bool isPage = false;           ///< a browser may run it: the response has a security policy
};

/// Whether If-None-Match names the tag: a list of tags, or "*".
bool matchesTag(std::string_view ifNoneMatch, std::string_view tag);

/// Whether Accept-Encoding allows gzip.
bool acceptsGzip(std::string_view acceptEncoding);

/// By the name's extension; "application/octet-stream" if it is unknown.
std::string findContentType(std::string_view fileName);

/// The header of a response with the file.
std::string makeFileHeader(const HttpFile& file);
/// The whole response 304, without a body.
std::string makeNotModified(const HttpFile& file);

}  // namespace enfilade::server
