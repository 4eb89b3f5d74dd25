#include "scene/import/assembly/path_names.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

namespace enfilade::scene {
namespace {

/// Length in bytes of the UTF-8 sequence at `i`; 0 if it is invalid.
std::size_t utf8SequenceLength(std::string_view text, std::size_t i) {
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
    const std::size_t length = utf8SequenceLength(name, i);
    if (length == 0 || c < 0x20 || c == 0x7f || c == '/' || c == '%') {
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

std::size_t mendUtf8(std::string& text) {
  constexpr std::uint64_t kHighBits = 0x8080808080808080u;
  std::string mended;
  std::size_t count = 0, copied = 0;
  for (std::size_t i = 0; i < text.size();) {
    std::uint64_t eight = kHighBits;
    if (i + sizeof eight <= text.size()) std::memcpy(&eight, text.data() + i, sizeof eight);
    const bool ascii = (eight & kHighBits) == 0;
    const std::size_t length = ascii ? sizeof eight : utf8SequenceLength(text, i);
    if (length == 0) {
      const auto c = static_cast<unsigned char>(text[i]);
      mended.append(text, copied, i - copied);
      mended += static_cast<char>(0xc0 | c >> 6);
      mended += static_cast<char>(0x80 | (c & 0x3f));
      copied = i + 1;
      ++count;
    }
    i += std::max<std::size_t>(length, 1);
  }
  if (count > 0) text = std::move(mended.append(text, copied));
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
