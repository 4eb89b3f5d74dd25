#include "server/capture/capture_progress.hpp"

#include <array>
#include <cstdio>

namespace enfilade::server {
namespace {

constexpr std::chrono::milliseconds kLinePeriod{500};

std::string formatDuration(double seconds) {
  std::array<char, 40> text{};
  const auto whole = static_cast<long>(seconds + 0.5);
  if (whole < 90) {
    std::snprintf(text.data(), text.size(), "%ld s", whole);
  } else if (whole < 5400) {
    std::snprintf(text.data(), text.size(), "%ld min %02ld s", whole / 60, whole % 60);
  } else {
    std::snprintf(text.data(), text.size(), "%ld h %02ld min", whole / 3600, whole / 60 % 60);
  }
  return text.data();
}

}  // namespace

CaptureProgress::CaptureProgress(ProgressFormat kind, std::size_t frames)
    : format_(kind), frames_(frames) {}

void CaptureProgress::printLine(std::size_t done, double seconds, double left) const {
  std::fprintf(stderr, "{\"frames\":%zu,\"of\":%zu,\"seconds\":%.3f,\"seconds_left\":%.3f}\n", done,
               frames_, seconds, left);
}

void CaptureProgress::update(std::size_t done) {
  const auto now = Clock::now();
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const double share =
      static_cast<double>(done) / static_cast<double>(std::max<std::size_t>(frames_, 1));
  const double left = share > 0 ? seconds * (1 - share) / share : 0;
  if (format_ == ProgressFormat::json) {
    if (now < nextLine_) return;
    nextLine_ = now + kLinePeriod;
    printLine(done, seconds, left);
    return;
  }
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(), "%zu of %zu frames, %.1f per second", done, frames_,
                seconds > 0 ? static_cast<double>(done) / seconds : 0.0);
  bar_.show(share, std::string(text.data()) +
                       (share > 0 ? ", " + formatDuration(left) + " left" : std::string()));
}

void CaptureProgress::finish(std::size_t done) {
  bar_.clear();
  const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  if (format_ == ProgressFormat::json) printLine(done, seconds, 0);
}

}  // namespace enfilade::server
