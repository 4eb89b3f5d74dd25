#include "scene/import/file/uri.hpp"

#include <charconv>

namespace enfilade::scene {

std::string decodePercent(std::string_view uri) {
  std::string plain;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned char byte = 0;
    const char* digits = uri.data() + i + 1;
    const bool coded = uri[i] == '%' && i + 2 < uri.size() &&
                       std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2;
    plain += coded ? static_cast<char>(byte) : uri[i];
    if (coded) i += 2;
  }
  return plain;
}

std::string shortenUri(const std::string& uri) {
  constexpr std::size_t kMaxShown = 120, kStart = 60, kEnd = 20;  // bytes
  if (uri.size() <= kMaxShown) return uri;
  // No character of UTF-8 is cut: its other bytes are 0x80 to 0xBF.
  const auto isCut = [&](std::size_t at) { return (uri[at] & 0xC0) == 0x80; };
  std::size_t start = kStart, end = uri.size() - kEnd;
  while (start > 0 && isCut(start)) --start;
  while (end < uri.size() && isCut(end)) ++end;
  return uri.substr(0, start) + "..[" + std::to_string(end - start) + " bytes].." + uri.substr(end);
}

}  // namespace enfilade::scene
