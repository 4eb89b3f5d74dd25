// Parser of one line of a walk script; private to protocol/script/.
#pragma once

#include "protocol/script/script.hpp"

namespace enfilade::protocol {

/// An error in a line, without file name and line number.
struct LineError {
  std::string text;
};

/// Throws LineError.
[[noreturn]] void refuse(std::string_view field, const std::string& text);

/// Throws LineError if the text is not UTF-8.
void checkUtf8(std::string_view text);

/// Parses a line; its `number` becomes the command's tag. Throws LineError.
std::variant<v1::Command, v1::BodyCommand, GlobalWait> parseLine(std::string_view text,
                                                                 std::uint32_t number);

}  // namespace enfilade::protocol
