#include "scene/import/assembly/path_names.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

namespace enfilade::scene {
namespace {

/// Length in bytes of the UTF-8 sequence at `i`; 0 if it is invalid.
std::size_t getUtf8SequenceLength(std::string_view text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned char first = byte(i);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || i + length > text.size()) return 0;
  for (std::size_t k = i + 1; k < i + length; ++k) {
    if ((byte(k) & 0xc0) != 0x80) return 0;
  }
  // Reject overlong forms, surrogates and code points beyond U+10FFFF.
  const unsigned char second = byte(i + 1);
  if ((first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f) ||
      (first == 0xf0 && second < 0x90) || (first == 0xf4 && second > 0x8f)) {
    return 0;
  }
  return length;
}

/// The character of a byte above 0x7f in Windows-1252, which extends Latin-1.
char16_t decodeWindows1252(unsigned char byte) {
  static constexpr std::u16string_view kFirst =  // 0x80 to 0x9f; U+FFFD: undefined
      u"\u20ac\ufffd\u201a\u0192\u201e\u2026\u2020\u2021\u02c6\u2030\u0160\u2039\u0152\ufffd\u017d"
      u"\ufffd"
      u"\ufffd\u2018\u2019\u201c\u201d\u2022\u2013\u2014\u02dc\u2122\u0161\u203a\u0153\ufffd\u017e"
      u"\u0178";
  return byte < 0xa0 ? kFirst[byte - 0x80u] : byte;
}

void appendUtf8(std::string& to, char16_t character) {
  if (character < 0x800) {
    to += static_cast<char>(0xc0 | character >> 6);
  } else {
    to += static_cast<char>(0xe0 | character >> 12);
    to += static_cast<char>(0x80 | (character >> 6 & 0x3f));
  }
  to += static_cast<char>(0x80 | (character & 0x3f));
}

bool isDigits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Names that assimp generates for unnamed nodes, in files that it wrote, too. They contain a
/// counter, so they are not stable.
bool isGeneratedName(std::string_view name) {
  if (name.starts_with("$ColladaAutoName$")) return true;
  if (name.starts_with("nodes[") && name.ends_with("]")) {
    return isDigits(name.substr(6, name.size() - 7));
  }
  return name.starts_with("nodes_") && isDigits(name.substr(6));
}

}  // namespace

std::string makeNodeSegment(std::string_view name) {
  return name.empty() || isGeneratedName(name) ? "node" : encodePathSegment(name);
}

std::string encodePathSegment(std::string_view name) {
  static constexpr char kDigits[] = "0123456789ABCDEF";
  std::string result;
  for (std::size_t i = 0; i < name.size();) {
    const auto c = static_cast<unsigned char>(name[i]);
    const std::size_t length = getUtf8SequenceLength(name, i);
    const bool isControl =
        c < 0x20 || c == 0x7f || (c == 0xc2 && length == 2 && (name[i + 1] & 0x20) == 0);
    if (length == 0 || isControl || c == '/' || c == '%') {
      result += '%';
      result += kDigits[c >> 4];
      result += kDigits[c & 15];
      ++i;
    } else {
      result += name.substr(i, length);
      i += length;
    }
  }
  return result;
}

std::size_t decodeOtherBytes(std::string& text) {
  constexpr std::uint64_t kHighBits = 0x8080808080808080u;
  std::string repaired;
  std::size_t count = 0, copied = 0;
  for (std::size_t i = 0; i < text.size();) {
    std::uint64_t eight = kHighBits;
    if (i + sizeof eight <= text.size()) std::memcpy(&eight, text.data() + i, sizeof eight);
    const bool ascii = (eight & kHighBits) == 0;
    const std::size_t length = ascii ? sizeof eight : getUtf8SequenceLength(text, i);
    if (length == 0) {
      repaired.append(text, copied, i - copied);
      appendUtf8(repaired, decodeWindows1252(static_cast<unsigned char>(text[i])));
      copied = i + 1;
      ++count;
    }
    i += std::max<std::size_t>(length, 1);
  }
  if (count > 0) text = std::move(repaired.append(text, copied));
  return count;
}

std::string SiblingNames::makeUnique(const std::string& name) {
  if (repeats_.try_emplace(name, 0).second) return name;
  std::size_t repeats = repeats_[name];
  std::string unique;
  do {
    ++repeats;
    unique = name + "#" + std::to_string(repeats + 1);
  } while (!repeats_.try_emplace(unique, 0).second);
  repeats_[name] = repeats;
  return unique;
}

}  // namespace enfilade::scene
