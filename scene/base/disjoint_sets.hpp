// Disjoint sets (union-find): islands of bodies, pieces of shapes, joined parts of a mesh.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "collision/assert.hpp"

namespace enfilade::scene {

/// Sets of indices that unite() merges. The representative of a set is its smallest index, whatever
/// the order of merging.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) : parents_(size) {
    std::iota(parents_.begin(), parents_.end(), 0u);
  }

  std::uint32_t find(std::uint32_t index) {
    ENFILADE_ASSERT(index < parents_.size());
    while (parents_[index] != index) {  // ends: a parent is smaller than its child
      parents_[index] = parents_[parents_[index]];
      index = parents_[index];
    }
    return index;
  }

  void unite(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t first = find(a), second = find(b);
    parents_[std::max(first, second)] = std::min(first, second);
  }

 private:
  std::vector<std::uint32_t> parents_;
};

}  // namespace enfilade::scene
