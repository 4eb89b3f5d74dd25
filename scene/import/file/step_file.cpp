#include "scene/import/file/step_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "scene/model/trim.hpp"

namespace enfilade::scene {
namespace {

/// Blanks out /* comments */ outside of strings; an unclosed comment is kept.
void blankComments(std::string& text) {
  if (text.find("/*") == std::string::npos) return;  // most files: several times as fast
  bool quoted = false;
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (text[i] == '\'') quoted = !quoted;
    if (quoted || text[i] != '/' || text[i + 1] != '*') continue;
    const std::size_t end = text.find("*/", i + 2);
    if (end == std::string::npos) return;
    std::fill(text.begin() + static_cast<std::ptrdiff_t>(i),
              text.begin() + static_cast<std::ptrdiff_t>(end + 2), ' ');
    i = end + 1;
  }
}

void appendUtf8(std::string& to, std::uint32_t code) {
  if (code == 0 || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) code = 0xfffd;
  const auto put = [&](std::uint32_t byte) { to += static_cast<char>(byte); };
  if (code < 0x80) return put(code);
  if (code < 0x800) return put(0xc0 | code >> 6), put(0x80 | (code & 63));
  if (code < 0x10000) {
    return put(0xe0 | code >> 12), put(0x80 | (code >> 6 & 63)), put(0x80 | (code & 63));
  }
  put(0xf0 | code >> 18), put(0x80 | (code >> 12 & 63)), put(0x80 | (code >> 6 & 63));
  put(0x80 | (code & 63));
}

std::optional<std::uint32_t> parseHex(std::string_view digits, std::size_t count) {
  std::uint32_t value = 0;
  if (digits.size() < count) return std::nullopt;
  const char* end = digits.data() + count;
  const auto read = std::from_chars(digits.data(), end, value, 16);
  return read.ec == std::errc() && read.ptr == end ? std::optional(value) : std::nullopt;
}

/// Decodes groups of `width` hexadecimal digits up to \X0\; returns the number of characters used.
std::size_t decodeGroups(std::string_view rest, std::size_t width, std::string& to) {
  std::size_t at = 0;
  std::uint32_t high = 0;  // the high surrogate of a UTF-16 pair
  while (const auto code = parseHex(rest.substr(at), width)) {
    at += width;
    if (*code >= 0xd800 && *code < 0xdc00) {
      high = *code;
    } else if (high != 0 && *code >= 0xdc00 && *code < 0xe000) {
      appendUtf8(to, 0x10000 + ((high - 0xd800) << 10) + (*code - 0xdc00));
      high = 0;
    } else {
      appendUtf8(to, *code);
    }
  }
  return rest.substr(at).starts_with("\\X0\\") ? at + 4 : at;
}

/// Decodes an escape sequence (ISO 10303-21, 6.4.3). Returns the number of characters used; 0: not
/// an escape sequence.
std::size_t decodeEscape(std::string_view text, std::string& to) {
  if (text.starts_with("\\\\")) return to += '\\', 2;
  if (text.starts_with("\\X2\\")) return 4 + decodeGroups(text.substr(4), 4, to);
  if (text.starts_with("\\X4\\")) return 4 + decodeGroups(text.substr(4), 8, to);
  if (text.starts_with("\\X\\")) {
    if (const auto code = parseHex(text.substr(3), 2)) return appendUtf8(to, *code), 5;
  }
  if (text.starts_with("\\S\\") && text.size() > 3) {
    return appendUtf8(to, 128u + (static_cast<unsigned char>(text[3]) & 127u)), 4;
  }
  return 0;
}

/// Position of the quote that closes the string opened at `begin`, or the end of the text.
std::size_t findClosingQuote(std::string_view text, std::size_t begin) {
  for (std::size_t i = begin + 1; i < text.size(); ++i) {
    if (text[i] != '\'') continue;
    if (i + 1 < text.size() && text[i + 1] == '\'') {
      ++i;
    } else {
      return i;
    }
  }
  return text.size();
}

}  // namespace

StepFile::StepFile(std::string text) : text_(std::move(text)) {
  blankComments(text_);
  const std::string_view all = text_;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i] == '\'') {
      const std::size_t close = findClosingQuote(all, i);
      const std::size_t next = all.substr(0, close).find("\n#", i);
      if (next == std::string_view::npos) {
        i = close;
      } else {  // missing quote: the next line is another statement
        ++damagedCount_;
        i = begin = next + 1;
      }
    }
    if (i >= all.size() || all[i] != ';') continue;
    addStatement(trim(all.substr(begin, i - begin)));
    begin = i + 1;
  }
  byId_.resize(statements_.size());
  for (std::uint32_t i = 0; i < byId_.size(); ++i) byId_[i] = i;
  if (std::ranges::is_sorted(statements_, {}, &StepStatement::id)) return;
  std::stable_sort(byId_.begin(), byId_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return statements_[a].id < statements_[b].id;
  });
}

void StepFile::addStatement(std::string_view statement) {
  if (statement.starts_with("FILE_SCHEMA")) {
    const std::size_t quote = statement.find('\'');
    if (quote == std::string_view::npos) return;
    schema_ = statement.substr(quote + 1, findClosingQuote(statement, quote) - quote - 1);
    return;
  }
  if (!statement.starts_with('#')) return;
  StepStatement parsed;
  const char* end = statement.data() + statement.size();
  const auto number = std::from_chars(statement.data() + 1, end, parsed.id);
  const std::string_view rest =
      trim(statement.substr(static_cast<std::size_t>(number.ptr - statement.data())));
  const std::size_t open = rest.find('(');
  const bool whole = number.ec == std::errc() && rest.starts_with('=') &&
                     open != std::string_view::npos && rest.ends_with(')');
  if (!whole) {
    ++damagedCount_;
    return;
  }
  parsed.type = trim(rest.substr(1, open - 1));
  parsed.arguments = rest.substr(open + 1, rest.size() - open - 2);
  statements_.push_back(parsed);
}

const StepStatement* StepFile::find(std::uint32_t id) const {
  const auto found =
      std::lower_bound(byId_.begin(), byId_.end(), id,
                       [&](std::uint32_t i, std::uint32_t b) { return statements_[i].id < b; });
  if (found == byId_.end() || statements_[*found].id != id) return nullptr;
  return &statements_[*found];
}

const StepStatement* StepFile::findOfType(std::uint32_t id, std::string_view type) const {
  const StepStatement* found = find(id);
  return found != nullptr && found->type == type ? found : nullptr;
}

bool StepFile::hasEnd() const {
  return text_.rfind("END-ISO-10303-21") != std::string::npos;
}

std::vector<std::string_view> splitStepArguments(std::string_view arguments) {
  std::vector<std::string_view> result;
  std::size_t begin = 0;
  int depth = 0;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const char c = arguments[i];
    if (c == '\'') i = findClosingQuote(arguments, i);
    if (c == '(') ++depth;
    if (c == ')') --depth;
    if (c != ',' || depth != 0) continue;
    result.push_back(trim(arguments.substr(begin, i - begin)));
    begin = i + 1;
  }
  result.push_back(trim(arguments.substr(begin)));
  return result;
}

std::optional<std::uint32_t> parseStepReference(std::string_view argument) {
  std::uint32_t id = 0;
  if (!argument.starts_with('#')) return std::nullopt;
  const char* end = argument.data() + argument.size();
  const auto read = std::from_chars(argument.data() + 1, end, id);
  return read.ec == std::errc() && read.ptr == end ? std::optional(id) : std::nullopt;
}

std::optional<double> parseStepNumber(std::string_view argument) {
  const std::size_t open = argument.find('(');
  if (open != std::string_view::npos && open > 0 && argument.ends_with(')')) {
    argument = trim(argument.substr(open + 1, argument.size() - open - 2));
  }
  if (argument.starts_with('+')) argument.remove_prefix(1);
  double value = 0;
  const char* end = argument.data() + argument.size();
  const auto read = std::from_chars(argument.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::string> parseStepString(std::string_view argument) {
  if (argument.size() < 2 || argument.front() != '\'' || argument.back() != '\'') {
    return std::nullopt;
  }
  const std::string_view text = argument.substr(1, argument.size() - 2);
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t used = text[i] == '\\' ? decodeEscape(text.substr(i), result) : 0;
    i += used;
    if (used > 0) continue;
    result += text[i];
    i += text[i] == '\'' ? 2 : 1;  // quotes are doubled
  }
  return result;
}

std::string_view parseStepEnum(std::string_view argument) {
  if (argument.size() < 3 || argument.front() != '.' || argument.back() != '.') return {};
  return argument.substr(1, argument.size() - 2);
}

std::vector<std::uint32_t> parseStepReferences(std::string_view argument) {
  std::vector<std::uint32_t> ids;
  if (argument.size() >= 2 && argument.front() == '(' && argument.back() == ')') {
    for (const std::string_view one : splitStepArguments(argument.substr(1, argument.size() - 2))) {
      if (const auto id = parseStepReference(one)) ids.push_back(*id);
    }
  } else if (const auto id = parseStepReference(argument)) {
    ids.push_back(*id);
  }
  return ids;
}

std::vector<double> parseStepNumbers(std::string_view argument) {
  std::vector<double> numbers;
  if (argument.size() < 2 || argument.front() != '(' || argument.back() != ')') return numbers;
  for (const std::string_view one : splitStepArguments(argument.substr(1, argument.size() - 2))) {
    if (const auto number = parseStepNumber(one)) numbers.push_back(*number);
  }
  return numbers;
}

}  // namespace enfilade::scene
