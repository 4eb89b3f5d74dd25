// How far a capture is, on stderr: a bar with the time left, or lines of JSON.
#pragma once

#include <chrono>

#include "server/base/progress.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

class CaptureMeter {
 public:
  CaptureMeter(CaptureProgress kind, std::size_t frames);

  /// `done` of the frames are written. Cheap: it writes now and then only.
  void show(std::size_t done);
  void finish(std::size_t done);

 private:
  using Clock = std::chrono::steady_clock;
  void line(std::size_t done, double seconds, double left) const;

  const CaptureProgress kind_;
  const std::size_t frames_;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point next_ = start_;
  Progress bar_;
};

}  // namespace enfilade::server
