#include "server/base/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace enfilade::server {
namespace {

constexpr std::chrono::milliseconds kBarPeriod{100};
constexpr std::chrono::seconds kLinePeriod{5};
constexpr int kBarWidth = 30;

}  // namespace

Progress::Progress()
    : terminal_(::isatty(STDERR_FILENO) == 1),
      next_(std::chrono::steady_clock::now() +
            (terminal_ ? std::chrono::milliseconds(0) : kLinePeriod)) {}

Progress::~Progress() {
  clear();
}

void Progress::show(double fraction, const std::string& text) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  const double clampedFraction = std::clamp(fraction, 0.0, 1.0);
  const int percent = static_cast<int>(100 * clampedFraction);
  if (!terminal_) {
    next_ = now + kLinePeriod;
    std::fprintf(stderr, "%3d %%  %s\n", percent, text.c_str());
    return;
  }
  next_ = now + kBarPeriod;
  const auto filled = static_cast<std::size_t>(kBarWidth * clampedFraction);
  const std::string bar = std::string(filled, '#') + std::string(kBarWidth - filled, '-');
  std::fprintf(stderr, "\r\033[K[%s] %3d %%  %s", bar.c_str(), percent, text.c_str());
  std::fflush(stderr);
  shown_ = true;
}

void Progress::clear() {
  if (shown_) std::fputs("\r\033[K", stderr);
  shown_ = false;
}

}  // namespace enfilade::server
