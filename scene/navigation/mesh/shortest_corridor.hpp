// Finds the corridor of the shortest path over a navigation mesh (Polyanya).
#pragma once

#include <optional>

#include "scene/navigation/mesh/navigation_mesh.hpp"

namespace enfilade::scene {

/// The corridor of the shortest line between two points, by horizontal length in metres. A* through
/// the middles of portals may miss it. nullopt: none is shorter than
/// `bound` metres, or the search met its limit. Source: Polyanya, Cui et al. 2017.
std::optional<Corridor> findShortestCorridor(const NavigationMesh& mesh, const MeshPoint& from,
                                             const MeshPoint& to, double bound);

}  // namespace enfilade::scene
