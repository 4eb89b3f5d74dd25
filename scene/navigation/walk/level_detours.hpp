// Detours around low objects, onto which an agent would step for a moment, as onto the corner of a
// low bed: the shortest line on a navigation mesh ignores heights.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "scene/navigation/walk/walker.hpp"

namespace enfilade::scene {

inline constexpr double kMinBump = 0.1;  ///< metres up and down together: lower ones stay

/// Places before and after bumps that have no shorter way around.
using BumpList = std::vector<std::pair<Vec3, Vec3>>;

/// Replaces parts of a path that lead up and down again by ways around them, if this shortens the
/// way of the feet. Each leg of `places` can be walked. Bumps near `known` ones stay; appends those
/// without a shorter way around. Returns whether the path changed.
bool goAroundBumps(Walker& walker, std::vector<Vec3>& places, BumpList& known);

/// The middle of the first part that leads up and down again; nullopt: none does.
std::optional<Vec3> findBump(Walker& walker, const std::vector<Vec3>& places);

}  // namespace enfilade::scene
