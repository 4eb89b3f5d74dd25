// Tells on stderr how far a run is: a bar on a terminal, a line now and then elsewhere.
#pragma once

#include <chrono>
#include <string>

namespace enfilade::server {

class Progress {
 public:
  Progress();
  ~Progress();  ///< leaves the line clean
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `fraction` is 0..1. Cheap: it writes only when the last writing was a while ago.
  void show(double fraction, const std::string& text);
  /// Takes the bar away, so that something else can be written.
  void clear();

 private:
  const bool terminal_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace enfilade::server
