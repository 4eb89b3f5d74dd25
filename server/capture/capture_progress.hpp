// Progress of a capture on stderr: a bar with the remaining time, or JSON lines.
#pragma once

#include <chrono>

#include "server/base/progress.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

class CaptureProgress {
 public:
  CaptureProgress(ProgressFormat kind, std::size_t frames);

  /// Reports `done` written frames. Prints at intervals only, so that calls are cheap.
  void update(std::size_t done);
  void finish(std::size_t done);

 private:
  using Clock = std::chrono::steady_clock;
  void printLine(std::size_t done, double seconds, double left) const;

  const ProgressFormat format_;
  const std::size_t frames_;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point nextLine_ = start_;
  Progress bar_;
};

}  // namespace enfilade::server
