#include "scene/world/avatars/avatar_islands.hpp"

#include <algorithm>

#include "collision/assert.hpp"
#include "scene/base/disjoint_sets.hpp"

namespace enfilade::scene {
namespace {

/// Unites the avatar with those that its motion bounds overlap.
void uniteWithNeighbours(const WorldData& world, std::uint32_t index, DisjointSets& islands) {
  for (const auto& overlap : world.broadPhase.getDynamicOverlaps(world.avatars[index].proxy))
    if (const Avatar* other = world.findAvatarByProxy(overlap.id))
      islands.unite(index, static_cast<std::uint32_t>(other - world.avatars.data()));
}

}  // namespace

AvatarIslands::AvatarIslands(const WorldData& world) {
  const auto count = static_cast<std::uint32_t>(world.avatars.size());
  DisjointSets islands(count);
  for (std::uint32_t i = 0; i < count; ++i)
    if (!world.avatars[i].idle) uniteWithNeighbours(world, i, islands);
  // A counting sort by representative, which is the smallest member.
  std::vector<std::uint32_t> sizes(count, 0);
  for (std::uint32_t i = 0; i < count; ++i)
    if (!world.avatars[i].idle) ++sizes[islands.find(i)];
  std::vector<std::uint32_t> next(count, 0);
  begins_.push_back(0);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (sizes[i] == 0) continue;
    next[i] = begins_.back();
    begins_.push_back(begins_.back() + sizes[i]);
  }
  members_.resize(begins_.back());
  for (std::uint32_t i = 0; i < count; ++i)
    if (!world.avatars[i].idle) members_[next[islands.find(i)]++] = i;
  for (std::size_t island = 0; island < size(); ++island)
    ENFILADE_ASSERT(std::ranges::is_sorted(members(island)));
}

}  // namespace enfilade::scene
