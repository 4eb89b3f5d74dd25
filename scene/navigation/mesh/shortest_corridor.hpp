// Finds the corridor of the shortest path over a navigation mesh (Polyanya).
#pragma once

#include <cstdint>
#include <optional>

#include "scene/navigation/mesh/navigation_mesh.hpp"

namespace enfilade::scene {

/// Whether lines lead through portals that searches closed.
enum class ClosedPortals : std::uint8_t { block, open };

/// The corridor of the shortest line between two points on different polygons, by horizontal length
/// in metres. A* through the middles of portals may miss it. nullopt: none is shorter than
/// `bound` metres, or the search met its limit. Source: Polyanya, Cui et al. 2017.
std::optional<Corridor> findShortestCorridor(const NavigationMesh& mesh, const MeshPoint& from,
                                             const MeshPoint& to, double bound,
                                             ClosedPortals closed = ClosedPortals::block);

}  // namespace enfilade::scene
