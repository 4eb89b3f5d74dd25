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

}  // namespace enfilade::scene
