#include "server/capture/capture_progress.hpp"

#include <array>
#include <cstdio>

namespace enfilade::server {
namespace {

constexpr std::chrono::milliseconds kLinePeriod{500};

std::string durationText(double seconds) {
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

CaptureMeter::CaptureMeter(CaptureProgress kind, std::size_t frames)
    : kind_(kind), frames_(frames) {}

void CaptureMeter::line(std::size_t done, double seconds, double left) const {
  std::fprintf(stderr, "{\"frames\":%zu,\"of\":%zu,\"seconds\":%.3f,\"seconds_left\":%.3f}\n", done,
               frames_, seconds, left);
}

void CaptureMeter::show(std::size_t done) {
  const auto now = Clock::now();
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const double share =
      static_cast<double>(done) / static_cast<double>(std::max<std::size_t>(frames_, 1));
  const double left = share > 0 ? seconds * (1 - share) / share : 0;
  if (kind_ == CaptureProgress::json) {
    if (now < next_) return;
    next_ = now + kLinePeriod;
    line(done, seconds, left);
    return;
  }
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(), "%zu of %zu frames, %.1f a second", done, frames_,
                seconds > 0 ? static_cast<double>(done) / seconds : 0.0);
  bar_.show(share, std::string(text.data()) +
                       (share > 0 ? ", " + durationText(left) + " left" : std::string()));
}

void CaptureMeter::finish(std::size_t done) {
  bar_.clear();
  const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  if (kind_ == CaptureProgress::json) line(done, seconds, 0);
}

}  // namespace enfilade::server
