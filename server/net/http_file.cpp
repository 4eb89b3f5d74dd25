#include "server/net/http_file.hpp"

#include <algorithm>
#include <array>

#include "server/base/parse_number.hpp"
#include "server/base/version.hpp"

namespace enfilade::server {
namespace {

/// The page runs its own scripts only; WebAssembly and workers need an explicit permission. It
/// connects to this server, and to others if a user names one.
constexpr const char* kSecurityPolicy =
    "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; "
    "worker-src 'self' blob:; connect-src 'self' ws: wss: blob: data:; "
    "script-src 'self' 'wasm-unsafe-eval'";

struct ContentType {
  std::string_view extension;
  const char* type;
};

constexpr std::array<ContentType, 11> kContentTypes{{
    {"html", "text/html; charset=utf-8"},
    {"js", "text/javascript; charset=utf-8"},
    {"css", "text/css; charset=utf-8"},
    {"svg", "image/svg+xml"},
    {"png", "image/png"},
    {"ico", "image/x-icon"},
    {"wasm", "application/wasm"},
    {"json", "application/json"},
    {"woff2", "font/woff2"},
    {"txt", "text/plain; charset=utf-8"},
    {"glb", "model/gltf-binary"},
}};

std::string_view trimSpaces(std::string_view text) {
  const auto isSpace = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && isSpace(text.front())) text.remove_prefix(1);
  while (!text.empty() && isSpace(text.back())) text.remove_suffix(1);
  return text;
}

/// Calls `see` with each element of a list that is separated by `separator`.
template <class See>
void forEachElement(std::string_view list, char separator, const See& see) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(separator), list.size());
    see(trimSpaces(list.substr(0, end)));
    list.remove_prefix(std::min(end + 1, list.size()));
  }
}

/// Headers that a response and its 304 share.
std::string makeSharedHeaders(const HttpFile& file) {
  std::string head = std::string("Server: enfilade ") + kServerVersion + "\r\nETag: \"" + file.tag +
                     "\"\r\nCache-Control: no-cache\r\nX-Content-Type-Options: nosniff\r\n";
  if (file.mayBeCompressed) head += "Vary: Accept-Encoding\r\n";
  if (file.isPage)
    head += std::string("Content-Security-Policy: ") + kSecurityPolicy +
            "\r\nReferrer-Policy: no-referrer\r\n";
  return head + "Connection: close\r\n";
}

}  // namespace

bool matchesTag(std::string_view ifNoneMatch, std::string_view tag) {
  bool matches = false;
  forEachElement(ifNoneMatch, ',', [&](std::string_view one) {
    if (one.starts_with("W/")) one.remove_prefix(2);  // the comparison is weak
    const bool quoted = one.size() >= 2 && one.front() == '"' && one.back() == '"';
    matches = matches || one == "*" || (quoted && one.substr(1, one.size() - 2) == tag);
  });
  return matches;
}

bool acceptsGzip(std::string_view acceptEncoding) {
  bool accepts = false;
  forEachElement(acceptEncoding, ',', [&](std::string_view one) {
    const std::size_t end = std::min(one.find(';'), one.size());
    const std::string_view coding = trimSpaces(one.substr(0, end));
    double quality = 1;
    if (end < one.size()) {
      const std::string_view parameter = trimSpaces(one.substr(end + 1));
      if (parameter.starts_with("q="))
        quality = parseNumber<double>(std::string(parameter.substr(2))).value_or(0);
    }
    if (coding == "gzip" || coding == "x-gzip") accepts = quality > 0;
  });
  return accepts;
}

std::string findContentType(std::string_view fileName) {
  const std::size_t dot = fileName.rfind('.');
  const std::string_view extension = dot == std::string_view::npos ? "" : fileName.substr(dot + 1);
  const auto found =
      std::find_if(kContentTypes.begin(), kContentTypes.end(),
                   [&](const ContentType& one) { return one.extension == extension; });
  return found == kContentTypes.end() ? "application/octet-stream" : found->type;
}

std::string makeFileHeader(const HttpFile& file) {
  std::string head = "HTTP/1.1 200 OK\r\nContent-Type: " + file.contentType +
                     "\r\nContent-Length: " + std::to_string(file.bytes->size()) + "\r\n";
  if (file.isCompressed) head += "Content-Encoding: gzip\r\n";
  return head + makeSharedHeaders(file) + "\r\n";
}

std::string makeNotModified(const HttpFile& file) {
  return "HTTP/1.1 304 Not Modified\r\n" + makeSharedHeaders(file) + "\r\n";
}

}  // namespace enfilade::server
