// Finds standing places: positions at which an agent fits and has a floor.
#pragma once

#include <cstdint>
#include <optional>

#include "scene/navigation/mesh/navigation_mesh.hpp"
#include "scene/navigation/walk/walker.hpp"

namespace enfilade::scene {

/// metres. Users give the floor's own height, or a little more.
inline constexpr double kMaxStandDrop = 0.6;
/// metres. Heights of polygons are those of voxels.
inline constexpr double kHeightError = 0.3;

/// Puts the walker down at `point` and returns the place where it stands. nullopt: no room, or no
/// floor within `maxDrop` metres below.
std::optional<Vec3> standAt(Walker& walker, const Vec3& point, double maxDrop = kMaxStandDrop);

/// A place within 0.4 m of a point of a mesh, at about its height: polygons for scarce clearance
/// are too close to walls.
std::optional<Vec3> standNear(Walker& walker, const Vec3& point);

/// The polygon of a mesh at the height of a place and at most 5 cm away; nullopt: none is.
std::optional<std::uint32_t> findPolygonAt(const NavigationMesh& mesh, const Vec3& place);

}  // namespace enfilade::scene
