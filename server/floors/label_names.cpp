#include "server/floors/label_names.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

namespace enfilade::server {
namespace {

constexpr std::string_view kDigits = "0123456789";

/// Words that modellers and programs use for the pieces of a thing.
constexpr std::array<std::string_view, 26> kPieceWords{
    "board", "canvas",  "cap",       "collision", "face", "frame",  "geometry", "group", "leg",
    "link",  "mesh",    "model",     "mullion",   "node", "object", "pane",     "panel", "part",
    "piece", "plaster", "primitive", "seat",      "sill", "solid",  "transom",  "visual"};
/// Parts that programs append to a name, with or without a number.
constexpr std::array<std::string_view, 7> kAppended{
    "_node", "_visual", "_collision", "_mesh", "_geometry", "_primitive", "_link"};

/// Returns the index at which a part "_GlobalId" begins; npos: none. It has 22 digits of base 64,
/// the first below 4. Those of a word have no letters of both cases.
std::size_t findGlobalId(const std::string& name) {
  constexpr std::size_t kLength = 22;
  const auto isDigit = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '$';
  };
  const auto isUpper = [](char c) { return c >= 'A' && c <= 'Z'; };
  const auto isLower = [](char c) { return c >= 'a' && c <= 'z'; };
  for (std::size_t i = 0; i + kLength < name.size(); ++i) {
    const auto first = name.begin() + static_cast<std::ptrdiff_t>(i) + 1, end = first + kLength;
    if (name[i] == '_' && *first >= '0' && *first <= '3' && std::all_of(first, end, isDigit) &&
        std::any_of(first, end, isUpper) && std::any_of(first, end, isLower) &&
        (end == name.end() || *end == '_'))
      return i;
  }
  return std::string::npos;
}

/// Removes `separator` and a number from the end of a name. Returns whether they were there.
bool removeNumber(std::string& name, std::string_view separator) {
  const std::size_t last = name.find_last_not_of(kDigits);
  if (last == std::string::npos || last + 1 == name.size() || last + 1 <= separator.size())
    return false;
  const std::string_view before = std::string_view(name).substr(0, last + 1);
  if (!before.ends_with(separator)) return false;
  name.resize(before.size() - separator.size());
  return true;
}

bool removeAppended(std::string& name) {
  for (const std::string_view word : kAppended) {
    if (removeNumber(name, std::string(word) + "_")) return true;
    if (name.size() <= word.size() || !name.ends_with(word)) continue;
    name.resize(name.size() - word.size());
    return true;
  }
  return removeNumber(name, "#") || removeNumber(name, ":");  // a repeated name; Revit's element
}

/// Whether a part of a path is the word for a piece: "frame_left", "piece03".
bool isPiece(const std::string& name) {
  const std::size_t begin = name.find_first_not_of('_');
  if (begin == std::string::npos) return false;
  std::string word = name.substr(begin, name.find_first_of("_0123456789", begin) - begin);
  std::ranges::transform(word, word.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::find(kPieceWords, word) != kPieceWords.end();
}

std::string cleanName(const std::string& whole) {
  std::string name = removeGlobalId(whole);
  while (removeAppended(name)) {
  }
  const std::size_t last = name.rfind(':');
  if (last != std::string::npos && last > 0) {  // Revit repeats the type: "family:type:type"
    const std::size_t before = name.rfind(':', last - 1);
    const std::size_t start = before == std::string::npos ? 0 : before + 1;
    if (name.compare(start, last - start, name, last + 1) == 0) name.resize(last);
  }
  return name.empty() ? whole : name;
}

}  // namespace

std::string removeGlobalId(const std::string& name) {
  return name.substr(0, findGlobalId(name));
}

std::string makeLabelName(const std::string& path) {
  std::string rest = path, own;
  while (!rest.empty()) {
    const std::size_t slash = rest.find_last_of('/');
    const std::string name = cleanName(rest.substr(slash == std::string::npos ? 0 : slash + 1));
    if (own.empty()) own = name;
    if (!isPiece(name)) return name;
    rest.resize(slash == std::string::npos ? 0 : slash);
  }
  return own;
}

}  // namespace enfilade::server
