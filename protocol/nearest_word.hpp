// Finds the known word nearest to a misspelt one, by edit distance.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace enfilade::protocol {

/// Edits of one letter that turn one word into the other: insertions, deletions, replacements, and
/// exchanges of neighbours (Damerau 1964).
inline std::size_t computeEditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> beforeLast, last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] =
          std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], beforeLast[j - 2] + 1);
    }
    beforeLast = last;
    std::swap(last, row);
  }
  return last[b.size()];
}

/// The nearest of `words`; empty if none is within a third of its letters, or one edit.
inline std::string findNearestWord(std::string_view typed, std::span<const std::string> words) {
  std::string nearest;
  std::size_t minDistance = typed.size() < 64 ? std::max<std::size_t>(1, typed.size() / 3) + 1 : 0;
  for (const std::string& word : words) {
    const std::size_t distance = computeEditDistance(typed.substr(0, 64), word);
    if (distance < minDistance) minDistance = distance, nearest = word;
  }
  return nearest;
}

}  // namespace enfilade::protocol
