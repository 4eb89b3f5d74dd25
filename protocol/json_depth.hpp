// Nesting depth of JSON values. nlohmann serializes by recursion, so that a file of brackets would
// overflow the stack.
#pragma once

#include <algorithm>

namespace enfilade::protocol {

/// Maximum nesting of lists and objects; Enfilade's own files have less.
inline constexpr int kMaxJsonDepth = 16;

/// True if lists and objects are nested deeper than `depth`.
template <class Json>
bool isDeeperThan(const Json& value, int depth) {
  if (!value.is_structured()) return false;
  if (depth == 0) return true;
  return std::any_of(value.begin(), value.end(),
                     [&](const Json& inner) { return isDeeperThan(inner, depth - 1); });
}

}  // namespace enfilade::protocol
