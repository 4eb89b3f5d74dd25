// How deep a JSON value is nested: nlohmann writes values by recursion, and a file of brackets
// alone would end the program.
#pragma once

#include <algorithm>

namespace enfilade::protocol {

/// Lists and objects in one another: more than any file of ours has.
inline constexpr int kDeepestNest = 16;

/// Whether more than `depth` lists and objects lie in one another.
template <class Json>
bool isDeeper(const Json& value, int depth) {
  if (!value.is_structured()) return false;
  if (depth == 0) return true;
  return std::any_of(value.begin(), value.end(),
                     [&](const Json& inner) { return isDeeper(inner, depth - 1); });
}

}  // namespace enfilade::protocol
