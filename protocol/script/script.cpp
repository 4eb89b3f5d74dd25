#include "protocol/script/script.hpp"

#include <array>
#include <fstream>
#include <map>
#include <utility>

#include "protocol/script/line_error.hpp"
#include "protocol/script/script_line.hpp"

namespace enfilade::protocol {
namespace {

constexpr std::size_t kMaxScriptBytes = std::size_t{64} << 20;  // bytes
constexpr std::size_t kMaxLineBytes = std::size_t{1} << 20;     // bytes
constexpr std::size_t kMaxReportedErrors = 20;

bool isSkipped(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return true;
  text.remove_prefix(first);
  return text.starts_with('#') || text.starts_with("//");
}

/// Removes the next line from `text` and returns it without its line end.
std::string_view takeLine(std::string_view& text) {
  const std::size_t end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

/// Rejects duplicate capture names, so that no picture overwrites another.
class CaptureNames {
 public:
  void add(const ScriptLine& line) {
    const auto* command = std::get_if<v1::Command>(&line.action);
    if (!command || !command->has_capture()) return;
    const auto [entry, isNew] = lineByName_.try_emplace(command->capture().as(), line.number);
    if (!isNew) {
      refuse("as", "\"" + entry->first + "\" is already used in line " +
                       std::to_string(entry->second) + "; give another name");
    }
  }

 private:
  std::map<std::string, std::uint32_t> lineByName_;
};

ScriptLine readLine(std::string_view text, std::uint32_t number) {
  if (text.size() > kMaxLineBytes) {
    refuse("", "has " + std::to_string(text.size()) + " bytes; at most " +
                   std::to_string(kMaxLineBytes) + " are allowed");
  }
  return {number, parseLine(text, number)};
}

[[noreturn]] void throwErrors(const std::vector<std::string>& errors, std::size_t count,
                              std::uint32_t firstLine) {
  std::string text;
  for (const std::string& error : errors) text += (text.empty() ? "" : "\n") + error;
  if (count > errors.size()) {
    text += "\nand " + std::to_string(count - errors.size()) + " more bad lines";
  }
  throw ScriptError(text, firstLine);
}

}  // namespace

ScriptError::ScriptError(const std::string& text, std::uint32_t firstBadLine)
    : std::runtime_error(text), line(firstBadLine) {}

Script parseScript(std::string_view text, const std::string& source) {
  constexpr std::string_view byteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(byteOrderMark)) text.remove_prefix(byteOrderMark.size());
  Script script{source, {}};
  CaptureNames captures;
  std::vector<std::string> errors;
  std::size_t errorCount = 0;
  std::uint32_t firstBadLine = 0;
  for (std::uint32_t number = 1; !text.empty(); ++number) {
    const std::string_view line = takeLine(text);
    try {
      checkUtf8(line);
      if (isSkipped(line)) continue;
      ScriptLine read = readLine(line, number);
      captures.add(read);
      script.lines.push_back(std::move(read));
    } catch (const LineError& problem) {
      if (errorCount++ == 0) firstBadLine = number;
      if (errors.size() < kMaxReportedErrors) {
        errors.push_back(source + ":" + std::to_string(number) + ": " + problem.text);
      }
    }
  }
  if (errorCount > 0) throwErrors(errors, errorCount, firstBadLine);
  return script;
}

Script readScript(const std::filesystem::path& file) {
  std::error_code problem;
  const auto status = std::filesystem::status(file, problem);
  if (std::filesystem::is_directory(status)) {
    throw ScriptError(file.string() + ": is a folder; give a script file", 0);
  }
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    throw ScriptError(file.string() + ": cannot be opened; does it exist, and is it readable?", 0);
  }
  std::string text;
  std::array<char, 1 << 16> piece{};
  while (stream.read(piece.data(), piece.size()) || stream.gcount() > 0) {
    text.append(piece.data(), static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kMaxScriptBytes) {
      throw ScriptError(file.string() + ": is larger than " +
                            std::to_string(kMaxScriptBytes >> 20) + " MiB; is it a script?",
                        0);
    }
  }
  if (stream.bad()) throw ScriptError(file.string() + ": cannot be read completely", 0);
  return parseScript(text, file.string());
}

}  // namespace enfilade::protocol
