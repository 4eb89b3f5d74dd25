// LineError: the parse error of one line of a walk script. Private to protocol/script/.
#pragma once

#include <string>
#include <string_view>

namespace enfilade::protocol {

/// An error in a line, without file name and line number.
struct LineError {
  std::string text;
};

/// Throws LineError.
[[noreturn]] void refuse(std::string_view field, const std::string& text);

}  // namespace enfilade::protocol
