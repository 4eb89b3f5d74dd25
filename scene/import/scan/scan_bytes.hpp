// Reads numbers from the bytes of a file. Private to the import.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>

namespace enfilade::scene {

/// White space of the text formats.
constexpr bool isBlank(char c) {
  return c == ' ' || c == '\n' || c == '\r' || c == '\t' || c == '\v' || c == '\f';
}

/// Bytes at the end of a file that fill it up are no data.
inline std::size_t countDataBytes(std::string_view rest) {
  while (!rest.empty() && (rest.back() == '\0' || isBlank(rest.back()))) rest.remove_suffix(1);
  return rest.size();
}

/// Reads binary numbers; after the end, failed() is true and all numbers are zero.
class BinaryCursor {
 public:
  BinaryCursor(std::string_view bytes, bool bigEndian) : bytes_(bytes), bigEndian_(bigEndian) {}

  template <class Value>
  Value read() {
    char raw[sizeof(Value)] = {};  // NOLINT: bytes of a number
    if (bytes_.size() < sizeof(Value)) {
      failed_ = true;
      bytes_ = {};
      return Value{};
    }
    for (std::size_t i = 0; i < sizeof(Value); ++i)
      raw[bigEndian_ ? sizeof(Value) - 1 - i : i] = bytes_[i];
    bytes_.remove_prefix(sizeof(Value));
    Value value;
    std::memcpy(&value, raw, sizeof(Value));
    return value;
  }
  void skip(std::size_t size) {
    failed_ = failed_ || size > bytes_.size();
    bytes_.remove_prefix(size > bytes_.size() ? bytes_.size() : size);
  }
  std::size_t remaining() const { return bytes_.size(); }
  std::string_view rest() const { return bytes_; }
  bool failed() const { return failed_; }

 private:
  std::string_view bytes_;
  bool bigEndian_;
  bool failed_ = false;
};

/// Reads words that white space separates.
class TextCursor {
 public:
  explicit TextCursor(std::string_view text) : text_(text) {}

  /// The next word; empty at the end.
  std::string_view readWord() {
    std::size_t begin = 0;
    while (begin < text_.size() && isBlank(text_[begin])) ++begin;
    std::size_t end = begin;
    while (end < text_.size() && !isBlank(text_[end])) ++end;
    const std::string_view word = text_.substr(begin, end - begin);
    text_.remove_prefix(end);
    return word;
  }
  /// The rest of the line, without blanks around it.
  std::string_view readLine(char lineEnd = '\n') {
    const std::size_t end = std::min(text_.find(lineEnd), text_.size());
    std::string_view line = text_.substr(0, end);
    text_.remove_prefix(end < text_.size() ? end + 1 : end);
    while (!line.empty() && isBlank(line.front())) line.remove_prefix(1);
    while (!line.empty() && isBlank(line.back())) line.remove_suffix(1);
    return line;
  }
  /// The next word as a number. Other words, numbers out of range, and the end of the text set
  /// failed().
  double readNumber() {
    std::string_view word = readWord();
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || error != std::errc() || end != word.data() + word.size()) failed_ = true;
    return value;
  }
  std::size_t remaining() const { return text_.size(); }
  std::string_view rest() const { return text_; }
  bool failed() const { return failed_; }

 private:
  std::string_view text_;
  bool failed_ = false;
};

}  // namespace enfilade::scene
