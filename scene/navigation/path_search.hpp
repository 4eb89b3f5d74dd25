// Finds paths on the meshes of an agent, and proves them by walking.
#pragma once

#include <functional>

#include "scene/navigation/path_finder.hpp"

namespace enfilade::scene {

/// A path from where an agent at `from` stands to where it stands at `to`.
NavigationPath findPath(const PathFinder& finder, const Vec3& from, const Vec3& to);

/// A walk of PathLeg::Kind::aside to the closest place that is wanted, at most some 2 m away.
/// The reason is given only if no agent can stand at `from`.
NavigationPath findPathOut(Walker& walker, const Vec3& from,
                           const std::function<bool(const Vec3&)>& isWanted);

}  // namespace enfilade::scene
