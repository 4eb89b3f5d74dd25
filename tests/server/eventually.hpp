// Waits until a condition that another thread brings about holds.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace enfilade::server::testing {

/// Whether the condition becomes true within about 20 s.
inline bool becomesTrue(const std::function<bool()>& condition) {
  constexpr int kPatience = 4000;  // tries
  for (int i = 0; i < kPatience; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

}  // namespace enfilade::server::testing
