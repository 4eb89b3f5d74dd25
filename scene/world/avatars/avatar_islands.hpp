// Islands of avatars that may meet in a tick. Avatars of different islands read nothing that the
// other one writes, so islands move in parallel with the same result.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

class AvatarIslands {
 public:
  /// Of the avatars that are not idle. Avatars whose motion bounds overlap share an island.
  explicit AvatarIslands(const WorldData& world);

  std::size_t size() const { return begins_.size() - 1; }
  /// Indices into WorldData::avatars, ascending.
  std::span<const std::uint32_t> members(std::size_t island) const {
    return std::span(members_).subspan(begins_[island], begins_[island + 1] - begins_[island]);
  }

 private:
  std::vector<std::uint32_t> members_;  ///< island by island
  std::vector<std::uint32_t> begins_;   ///< of each island in `members_`, and the end
};

}  // namespace enfilade::scene
