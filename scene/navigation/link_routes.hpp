// Paths that jump down or ride lifts: a search over polygons and links, by expected time. The walks
// between the links are proved as other paths.
#pragma once

#include "scene/navigation/links.hpp"
#include "scene/navigation/path_finder.hpp"

namespace enfilade::scene {

/// The quickest path with links from where an agent at `from` stands to where it stands at `to`.
/// Returns `walked`, the path without links, if that is quicker or no other is found. `bodies`: the
/// present joint positions, for the wait for lifts.
NavigationPath findLinkedPath(const PathFinder& finder, Links& links, const Snapshot& bodies,
                              const Vec3& from, const Vec3& to, NavigationPath walked);

}  // namespace enfilade::scene
