// Parser of one line of a walk script; private to protocol/script/.
#pragma once

#include <cstdint>
#include <string_view>

#include "protocol/script/script_action.hpp"

namespace enfilade::protocol {

/// Throws LineError if the text is not UTF-8.
void checkUtf8(std::string_view text);

/// Parses a line; its `number` becomes the command's tag. Throws LineError.
ScriptAction parseLine(std::string_view text, std::uint32_t number);

}  // namespace enfilade::protocol
