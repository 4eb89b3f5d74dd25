// Interface of a fuzz target: a function that takes any bytes, and returns. Each target has its own
// source file that defines tryBytes(); enfilade_fuzz_target() links it with libFuzzer, or with a
// program that feeds it the committed corpus.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

namespace enfilade::fuzz {

/// Reports a fault by crashing, through a sanitizer, by an exception, or by require(). Keeps no
/// state between calls, so that one file reproduces a finding.
void tryBytes(std::span<const std::uint8_t> bytes);

/// Ends the program if a promise is broken.
inline void require(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

}  // namespace enfilade::fuzz
