// Which bodies hang together, and which of these groups are at rest.
#pragma once

#include <cstdint>
#include <vector>

namespace enfilade::scene {

/// Sets of indices that are joined step by step (union-find). The leader of a set is its least one,
/// whatever the order of joining.
class Islands {
 public:
  explicit Islands(std::size_t size);
  std::uint32_t leaderOf(std::uint32_t index);
  void join(std::uint32_t a, std::uint32_t b);

 private:
  std::vector<std::uint32_t> parents_;
};

}  // namespace enfilade::scene
