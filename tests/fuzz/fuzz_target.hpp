// What a fuzz target is: a function that takes any bytes, and returns. Each target has a source
// file of its own that defines tryBytes(); enfilade_fuzz_target() links it with libFuzzer, or with
// a program that feeds it the committed corpus.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

namespace enfilade::fuzz {

/// Finds a fault by crashing, through a sanitizer, by an exception, or by require(). Keeps nothing
/// from one call to the next, so that a finding is one file.
void tryBytes(std::span<const std::uint8_t> bytes);

/// Ends the program where a promise is broken.
inline void require(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

}  // namespace enfilade::fuzz
