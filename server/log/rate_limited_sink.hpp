// A log that a hostile client cannot flood: lines above a rate are counted and left out.
#pragma once

#include <spdlog/sinks/base_sink.h>

#include <chrono>
#include <memory>
#include <mutex>

namespace enfilade::server {

/// Passes lines to another sink, at most `maxLines` per second; errors always. The next second then
/// begins with the number of lines left out.
class RateLimitedSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  RateLimitedSink(spdlog::sink_ptr target, int maxLines);

 protected:
  void sink_it_(const spdlog::details::log_msg& line) override;
  void flush_() override { target_->flush(); }
  void set_formatter_(std::unique_ptr<spdlog::formatter> formatter) override {
    target_->set_formatter(std::move(formatter));
  }

 private:
  void reportLeftOut(const spdlog::details::log_msg& next);

  const spdlog::sink_ptr target_;
  const int maxLines_;
  std::chrono::system_clock::time_point second_;  ///< start of the present one
  int lines_ = 0, leftOut_ = 0;                   ///< in it
};

}  // namespace enfilade::server
