// One line of a walk script, read; private to protocol/script*.cpp.
#pragma once

#include "protocol/script/script.hpp"

namespace enfilade::protocol {

/// What is wrong with a line, without file and number.
struct LineProblem {
  std::string text;
};

/// Throws LineProblem.
[[noreturn]] void refuse(std::string_view field, const std::string& text);

/// Throws LineProblem for bytes that are not UTF-8 text.
void checkUtf8(std::string_view text);

/// Throws LineProblem. `number` of the line is the command's tag.
std::variant<v1::Command, v1::BodyCommand, GlobalWait> parseLine(std::string_view text,
                                                                 std::uint32_t number);

}  // namespace enfilade::protocol
