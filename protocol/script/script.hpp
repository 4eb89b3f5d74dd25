// Walk scripts: one JSON object per line (SCRIPT.md), parsed into commands.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/script/script_action.hpp"

namespace enfilade::protocol {

struct ScriptLine {
  std::uint32_t number = 0;  ///< line number from 1; also the command's tag
  ScriptAction action;
};

struct Script {
  std::string source;  ///< file name for messages
  std::vector<ScriptLine> lines;
};

/// Invalid lines of a script. The text has one line for each: "file:line: field: reason; remedy".
struct ScriptError : std::runtime_error {
  ScriptError(const std::string& text, std::uint32_t firstBadLine);
  std::uint32_t line;  ///< number of the first invalid line; 0: the whole file
};

/// Throws ScriptError.
Script readScript(const std::filesystem::path& file);
Script parseScript(std::string_view text, const std::string& source);

}  // namespace enfilade::protocol
