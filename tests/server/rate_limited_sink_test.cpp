// Tests of the log's limit of lines.
#include "server/log/rate_limited_sink.hpp"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

#include <algorithm>
#include <sstream>

namespace enfilade::server::testing {
namespace {

TEST(RateLimitedSink, CountsLinesAboveTheRateAndKeepsErrors) {
  std::ostringstream text;
  RateLimitedSink sink(std::make_shared<spdlog::sinks::ostream_sink_mt>(text), 3);
  sink.set_pattern("%l %v");
  const spdlog::log_clock::time_point start(std::chrono::hours(1));
  const auto log = [&](std::chrono::milliseconds time, spdlog::level::level_enum level,
                       const char* line) {
    sink.log(spdlog::details::log_msg(start + time, {}, "test", level, line));
  };
  using std::chrono::milliseconds;
  for (int i = 0; i < 10; ++i) log(milliseconds(i), spdlog::level::info, "flood");
  log(milliseconds(20), spdlog::level::err, "the disk is full");
  log(milliseconds(1000), spdlog::level::info, "calm");
  log(milliseconds(2100), spdlog::level::info, "calm");
  EXPECT_EQ(text.str(),
            "info flood\ninfo flood\ninfo flood\nerror the disk is full\n"
            "warning 7 lines were left out of the log\ninfo calm\ninfo calm\n");
}

}  // namespace
}  // namespace enfilade::server::testing
