// The log of the program: one line per call. Texts are formatted in log.cpp, because the library's
// templates cost each file that includes them seconds of compile time.
#pragma once

#include <fmt/core.h>

#include <cstdint>
#include <utility>

namespace enfilade::server {

enum class LogLevel : std::uint8_t { info, warning, error, critical };

void writeFormatted(LogLevel level, fmt::string_view text, fmt::format_args arguments);

/// `text` has a {} for each argument.
template <class... T>
void writeLog(LogLevel level, fmt::format_string<T...> text, T&&... arguments) {
  writeFormatted(level, text, fmt::make_format_args(arguments...));
}

template <class... T>
void logInfo(fmt::format_string<T...> text, T&&... arguments) {
  writeFormatted(LogLevel::info, text, fmt::make_format_args(arguments...));
}

template <class... T>
void logWarning(fmt::format_string<T...> text, T&&... arguments) {
  writeFormatted(LogLevel::warning, text, fmt::make_format_args(arguments...));
}

template <class... T>
void logError(fmt::format_string<T...> text, T&&... arguments) {
  writeFormatted(LogLevel::error, text, fmt::make_format_args(arguments...));
}

}  // namespace enfilade::server
