// Parses a whole text as one number.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace enfilade::server {

/// Decimal; nullopt if the text is not a number.
template <typename Number>
std::optional<Number> parseNumber(std::string_view text) {
  const char* end = text.data() + text.size();
  Number number{};
  const auto parsed = std::from_chars(text.data(), end, number);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  return number;
}

}  // namespace enfilade::server
