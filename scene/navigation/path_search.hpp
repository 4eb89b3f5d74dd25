// Finds paths on the meshes of an agent, and proves them by walking.
#pragma once

#include <functional>

#include "scene/navigation/path_finder.hpp"

namespace enfilade::scene {

/// A path from where an agent at `from` stands to where it stands at `to`.
NavigationPath findPath(const PathFinder& finder, const Vec3& from, const Vec3& to);

/// Keeps a path of findPath().
KeptPath keepPath(const PathFinder& finder, NavigationPath path, const Vec3& goal);

/// Lets a kept path begin at another place: an agent walks straight from there to one of its
/// points; what follows was proved by the search. False: such a walk does not exist, or against the
/// line on a mesh the path would be longer by more than 1 cm and 0.05 % than when it was found. If
/// it was longer than a line by over 2 % and 10 cm, or without one, also false farther from the
/// start of the search than 1 % of the path's length. A kept path is thus at most about 2 % and
/// 10 cm longer than a new one.
bool rejoinPath(const PathFinder& finder, KeptPath& kept, const Vec3& from);

/// A walk of PathLeg::Kind::aside to the closest place that is wanted, at most some 2 m away.
/// The reason is given only if no agent can stand at `from`.
NavigationPath findPathOut(Walker& walker, const Vec3& from,
                           const std::function<bool(const Vec3&)>& isWanted);

}  // namespace enfilade::scene
