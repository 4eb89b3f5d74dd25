// ENFILADE_ASSERT(condition): states what our own code guarantees. A failure is a fault of ours,
// never of a user's input: mistakes in files and messages are reported as errors instead.
#pragma once

#if defined(ENFILADE_ASSERTIONS)

#include <cstdio>
#include <cstdlib>

namespace enfilade {

/// Prints the place and the condition to stderr and aborts.
[[noreturn]] inline void failAssertion(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace enfilade

#define ENFILADE_ASSERT(...)                             \
  (static_cast<bool>(__VA_ARGS__) ? static_cast<void>(0) \
                                  : ::enfilade::failAssertion(#__VA_ARGS__, __FILE__, __LINE__))

#else

/// Compiled, never evaluated: a condition cannot rot, and costs nothing.
#define ENFILADE_ASSERT(...) static_cast<void>(sizeof(static_cast<bool>(__VA_ARGS__)))

#endif
