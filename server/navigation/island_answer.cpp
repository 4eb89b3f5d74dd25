#include "server/navigation/island_answer.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kMaxNeighbours = 4;  // that are tried, of larger islands and of smaller ones

/// A path to another island, and how much its reason explains.
struct Separation {
  v1::NavigationPath path;
  std::uint32_t to = 0;
  int worth = -1;
};

/// A path that was found, or an obstacle with the clear width there, ends a search.
int judgeReason(const v1::NavigationPath& path) {
  constexpr int kEnds = 2;
  if (path.found() || path.clear_width() > 0) return kEnds;
  return path.obstacle() != 0 ? 1 : 0;
}

/// Tries the larger neighbours, the closest first, then the smaller ones, then the largest island.
Separation findSeparation(const PathAnswer& answer, std::uint32_t island,
                          const std::vector<scene::Island>& islands) {
  Separation best;
  const auto attempt = [&](const scene::Vec3& from, const scene::Vec3& to, std::uint32_t number) {
    Separation found;
    writePath(answer, from, to, {}, {}, found.path);
    found.to = number;
    found.worth = judgeReason(found.path);
    if (found.path.found() && number > island) found.worth = 0;  // a smaller one, joined to this
    if (found.worth > best.worth) best = std::move(found);
    return best.worth > 1;
  };
  const auto neighbours = answer.navigation.findIslandNeighbours(island);
  for (const bool larger : {true, false}) {
    std::size_t tried = 0;
    for (const scene::IslandNeighbour& near : neighbours) {
      if ((near.number < island) != larger || tried++ == kMaxNeighbours) continue;
      if (attempt(near.from, near.to, near.number)) return best;
    }
  }
  if (best.worth < 1) attempt(islands[island].place, islands[0].place, 0);
  return best;
}

}  // namespace

void writeIslands(const PathAnswer& answer, std::size_t count, v1::NavigationReply& reply) {
  const std::vector<scene::Island> islands = answer.navigation.islands();
  for (std::size_t i = 0; i < std::min(count, islands.size()); ++i) {
    v1::NavigationIsland& island = *reply.add_islands();
    island.set_area(islands[i].area);
    *island.mutable_at() = toProto(islands[i].place);
    island.set_roof(islands[i].isRoof);
    island.set_drawn(islands[i].isDrawn);
    if (i == 0) continue;
    Separation separation = findSeparation(answer, static_cast<std::uint32_t>(i), islands);
    *island.mutable_path() = std::move(separation.path);
    island.set_to(separation.to);
  }
}

}  // namespace enfilade::server
