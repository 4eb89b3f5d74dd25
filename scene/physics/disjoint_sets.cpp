#include "scene/physics/disjoint_sets.hpp"

#include <algorithm>
#include <numeric>

namespace enfilade::scene {

Islands::Islands(std::size_t size) : parents_(size) {
  std::iota(parents_.begin(), parents_.end(), 0u);
}

std::uint32_t Islands::leaderOf(std::uint32_t index) {
  while (parents_[index] != index) {  // ends: a parent is less than its child
    parents_[index] = parents_[parents_[index]];
    index = parents_[index];
  }
  return index;
}

void Islands::join(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t first = leaderOf(a), second = leaderOf(b);
  parents_[std::max(first, second)] = std::min(first, second);
}

}  // namespace enfilade::scene
