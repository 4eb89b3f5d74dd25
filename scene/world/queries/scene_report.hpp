// Statistics and diagnostics of a scene, as printed by `enfilade inspect`.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/world/data/scene.hpp"

namespace enfilade::scene {

/// Connected surfaces of all objects, by their use for collision.
struct ShellCounts {
  std::size_t exact = 0;         ///< exactly convex: one hull
  std::size_t nearlyConvex = 0;  ///< convex up to the rounding of their coordinates: one hull
  std::size_t hollow = 0;        ///< convex, but around a cavity: triangles
  std::size_t inward = 0;  ///< closed, facing inwards, and large enough to be a room: triangles
  std::size_t closed = 0;  ///< closed, not convex: triangles
  std::size_t open = 0;  ///< with a boundary, or edges shared by more than two triangles: triangles
};

struct SceneReport {
  std::size_t objects = 0;       ///< without parts of other objects
  std::size_t solidObjects = 0;  ///< with an area, so that they can be touched
  std::size_t meshes = 0;
  std::size_t triangles = 0;        ///< of all objects
  std::size_t uniqueTriangles = 0;  ///< of all meshes
  std::size_t uniquePositions = 0;
  ShellCounts shells;
  std::size_t hullTriangles = 0;  ///< triangles of all objects that hulls replace
  std::size_t partTriangles = 0;  ///< triangles that remain triangles for collision
  /// The importer's diagnostics, then those of the geometry; defects of a mesh count once per mesh.
  std::vector<Diagnostic> diagnostics;
};

/// AABB of an object in its authored pose, static or not; empty if it has no area.
Aabb computeAuthoredAabb(const Scene& scene, std::uint32_t object);

/// Builds every shape, but not the collision geometry of static objects.
SceneReport makeSceneReport(const Scene& scene);

}  // namespace enfilade::scene
