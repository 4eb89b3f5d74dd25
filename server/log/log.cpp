#include "server/log/log.hpp"

#include <spdlog/spdlog.h>

namespace enfilade::server {
namespace {

spdlog::level::level_enum toSpdlog(LogLevel level) {
  switch (level) {
    case LogLevel::info:
      return spdlog::level::info;
    case LogLevel::warning:
      return spdlog::level::warn;
    case LogLevel::error:
      return spdlog::level::err;
    case LogLevel::critical:
      break;
  }
  return spdlog::level::critical;
}

}  // namespace

void writeFormatted(LogLevel level, fmt::string_view text, fmt::format_args arguments) {
  spdlog::logger& logger = *spdlog::default_logger_raw();
  if (logger.should_log(toSpdlog(level)))
    logger.log(toSpdlog(level), fmt::vformat(text, arguments));
}

}  // namespace enfilade::server
