// Progress display on stderr: a bar on a terminal, otherwise a line every few seconds.
#pragma once

#include <chrono>
#include <string>

namespace enfilade::server {

class Progress {
 public:
  Progress();
  ~Progress();  ///< clears the bar
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `fraction` is 0..1. Cheap: output is limited to one update per period.
  void show(double fraction, const std::string& text);
  /// Removes the bar, so that other output can be written.
  void clear();

 private:
  const bool terminal_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace enfilade::server
