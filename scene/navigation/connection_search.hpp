// Finds the off-mesh connections of a mesh by walking through gaps of its boundary.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <vector>

#include "scene/navigation/island_list.hpp"
#include "scene/navigation/mesh/off_mesh_connections.hpp"
#include "scene/navigation/path_search.hpp"

namespace enfilade::scene {

/// The paths across a gap, in both directions; empty: none was found, or the gap was given up.
struct GapPaths {
  std::vector<Vec3> there = {}, back = {};
  double reach = 0;  ///< metres from the straight line: what lies there can change the paths
};

/// Gaps that were tried, by the coordinates of both places: most stay as they are when a body
/// moves. The exit of a small island has its place twice.
using TriedGaps = std::map<std::array<double, 6>, GapPaths>;

std::size_t measureBytes(const TriedGaps& tried);

/// All off-mesh connections of `finder.ample`, the same for any number of threads. `islands`: as
/// collectIslands() returns them. `progress`, which may be empty, gets the share that is done.
ConnectionList collectConnections(PathFinder finder, const IslandList& islands, TriedGaps& tried,
                                  int threads, const std::function<void(double)>& progress);

/// Forgets gaps across which walks may end otherwise, since a body moved within this box.
void forgetGaps(TriedGaps& tried, const Aabb& box, const NavigationAgent& agent);

}  // namespace enfilade::scene
