#include "scene/import/gltf/encoding/data_uri.hpp"

#include <algorithm>

#include "scene/import/file/uri.hpp"
#include "scene/model/ascii.hpp"

namespace enfilade::scene {
namespace {

int decodeBase64Digit(char letter) {
  if (letter >= 'A' && letter <= 'Z') return letter - 'A';
  if (letter >= 'a' && letter <= 'z') return letter - 'a' + 26;
  if (letter >= '0' && letter <= '9') return letter - '0' + 52;
  if (letter == '+' || letter == '-') return 62;
  return letter == '/' || letter == '_' ? 63 : -1;
}

bool isLineEnd(char letter) {
  return letter == '\n' || letter == '\r' || letter == ' ' || letter == '\t';
}

/// The text without the characters that fill its last group.
std::string_view removePadding(std::string_view text) {
  while (!text.empty() && isLineEnd(text.back())) text.remove_suffix(1);
  for (int filled = 0; filled < 2 && text.ends_with('='); ++filled) text.remove_suffix(1);
  return text;
}

std::string decodeBase64(std::string_view text, std::string& fault) {
  std::string bytes;
  unsigned accumulator = 0;
  int bits = 0;
  const std::string_view digits = removePadding(text);
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (isLineEnd(digits[i])) continue;
    const int six = decodeBase64Digit(digits[i]);
    if (six < 0) {
      fault = "character " + std::to_string(i + 1) + " of its data URI is not Base64";
      return {};
    }
    accumulator = (accumulator << 6U | static_cast<unsigned>(six)) & 0xFFFFFFU;
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(accumulator >> static_cast<unsigned>(bits) & 255U);
  }
  return bytes;
}

constexpr std::string_view kScheme = "data:";

}  // namespace

bool isDataUri(std::string_view uri) {
  return toLowerCase(std::string(uri.substr(0, kScheme.size()))) == kScheme;
}

std::string lowerDataUri(const std::string& uri) {
  const std::size_t comma = std::min(uri.find(','), uri.size());
  return toLowerCase(uri.substr(0, comma)) + uri.substr(comma);
}

std::string decodeDataUri(std::string_view uri, std::string& fault) {
  const std::size_t comma = uri.find(',');
  if (comma == std::string_view::npos) return "";
  const std::string kind = toLowerCase(std::string(uri.substr(0, comma)));
  const std::string_view data = uri.substr(comma + 1);
  return kind.ends_with(";base64") ? decodeBase64(data, fault) : decodePercent(data);
}

bool isPlainDataUri(std::string_view uri, std::size_t size) {
  const std::size_t comma = uri.find(',');
  if (!uri.starts_with(kScheme) || comma == std::string_view::npos ||
      !uri.substr(0, comma).ends_with(";base64"))
    return false;
  const std::string_view digits = removePadding(uri.substr(comma + 1));
  return digits.size() / 4 * 3 + digits.size() % 4 * 3 / 4 >= size &&
         std::all_of(digits.begin(), digits.end(), [](char letter) {
           return decodeBase64Digit(letter) >= 0 && letter != '-' && letter != '_';
         });
}

}  // namespace enfilade::scene
