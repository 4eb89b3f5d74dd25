// Finds the passages of a mesh by walking through gaps of its rim.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <vector>

#include "scene/navigation/island_list.hpp"
#include "scene/navigation/passages.hpp"
#include "scene/navigation/path_finder.hpp"

namespace enfilade::scene {

/// The ways across a gap, in both directions; empty: none was found, or the gap was given up.
struct GapWays {
  std::vector<Vec3> there, back;
};

/// Gaps that were tried, by the coordinates of both places: most stay as they are when a body
/// moves. The exit of a small island has its place twice.
using TriedGaps = std::map<std::array<double, 6>, GapWays>;

/// All passages of `finder.ample`, the same for any number of threads. `islands`: as
/// collectIslands() returns them. `progress`, which may be empty, gets the share that is done.
PassageList collectPassages(PathFinder finder, const IslandList& islands, TriedGaps& tried,
                            int threads, const std::function<void(double)>& progress);

/// Forgets gaps across which walks may end otherwise, since a body moved within this box.
void forgetGaps(TriedGaps& tried, const Aabb& box);

}  // namespace enfilade::scene
