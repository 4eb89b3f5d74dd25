// Replaces parts of a path by shorter ways of the feet. The shortest line on a navigation mesh
// ignores heights, so an agent may step onto the corner of a low bed for a moment. Where a mesh
// ends early or is missing, a path has bends that it does not need.
#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "scene/navigation/walk/walker.hpp"

namespace enfilade::scene {

inline constexpr double kMinBump = 0.1;  ///< metres up and down together: lower ones stay

/// Places before and after bumps or bends.
using PartEnds = std::vector<std::pair<Vec3, Vec3>>;

/// Results and budget of the searches of a query.
struct BumpSearch {
  std::size_t maxWalks = 0;  ///< on grids
  PartEnds known = {};       ///< without a shorter way around: they are not searched again
};

/// Replaces parts of a path that lead up and down again by ways around them, if this shortens the
/// path of the feet. Each leg of `places` can be walked. Bumps of `search.known` stay. Returns
/// those that were replaced.
PartEnds goAroundBumps(Walker& walker, std::vector<Vec3>& places, BumpSearch& search);

/// Replaces bends of a path, some metres each, by shorter ways of the feet on grids of `spacing`
/// metres. Each leg of `places` can be walked. Subtracts the walks from `maxWalks`. False: no way
/// is shorter.
bool shortenBends(Walker& walker, std::vector<Vec3>& places, double spacing, std::size_t& maxWalks);

/// The middle of the first part that leads up and down again; nullopt: none does.
std::optional<Vec3> findBump(Walker& walker, const std::vector<Vec3>& places);

}  // namespace enfilade::scene
