#include "server/log/rate_limited_sink.hpp"

#include <spdlog/fmt/fmt.h>

#include <string>
#include <utility>

namespace enfilade::server {

RateLimitedSink::RateLimitedSink(spdlog::sink_ptr target, int maxLines)
    : target_(std::move(target)), maxLines_(maxLines) {}

void RateLimitedSink::sink_it_(const spdlog::details::log_msg& line) {
  if (line.time - second_ >= std::chrono::seconds(1) || line.time < second_) {
    if (leftOut_ > 0) reportLeftOut(line);
    second_ = line.time;
    lines_ = leftOut_ = 0;
  }
  const bool isError = line.level >= spdlog::level::err;
  if (!isError && lines_ >= maxLines_) {
    ++leftOut_;
    return;
  }
  ++lines_;
  target_->log(line);
}

void RateLimitedSink::reportLeftOut(const spdlog::details::log_msg& next) {
  const std::string text = fmt::format("{} lines were left out of the log", leftOut_);
  target_->log({next.time, {}, next.logger_name, spdlog::level::warn, text});
}

}  // namespace enfilade::server
