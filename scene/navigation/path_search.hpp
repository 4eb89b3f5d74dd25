// Finds paths on the meshes of an agent, and proves them by walking.
#pragma once

#include <functional>

#include "scene/navigation/path_finder.hpp"

namespace enfilade::scene {

/// A path from where an agent at `from` stands to where it stands at `to`.
NavigationPath findPath(const PathFinder& finder, const Vec3& from, const Vec3& to);

/// Keeps a path of findPath().
KeptPath keepPath(const PathFinder& finder, NavigationPath path, const Vec3& goal);

/// Lets a kept path begin at another place. An agent walks straight from there to one of its
/// points. The search proved the rest; over steps it is walked until it is as proved. False if such
/// a walk does not exist. Also false if, against the line on a mesh, the path would be longer by
/// over 1 cm and 0.05 % than when found. Some paths are kept only within 1 % of their length from
/// the start of the search. These are paths without a line, and those that were longer than it by
/// over 2 % and 10 cm. A kept path is thus at most about 2 % and 10 cm longer than a new one.
bool rejoinPath(const PathFinder& finder, KeptPath& kept, const Vec3& from);

/// A walk of PathLeg::Kind::aside to the closest place that is wanted, at most some 2 m away.
/// The reason is given only if no agent can stand at `from`.
NavigationPath findPathOut(Walker& walker, const Vec3& from,
                           const std::function<bool(const Vec3&)>& isWanted);

}  // namespace enfilade::scene
