// What is in a scene, counted, and what is odd about it: what `enfilade inspect` tells.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"

namespace enfilade::scene {

/// Pieces of surface that hang together, of all objects.
struct ShellCounts {
  std::size_t exact = 0;    ///< convex exactly, taken as one hull by collision
  std::size_t rounded = 0;  ///< convex up to the rounding of their coordinates, taken as one hull
  std::size_t hollow = 0;   ///< convex, but around a cavity: triangles
  std::size_t inward = 0;   ///< closed, seen from within, and room enough for somebody: triangles
  std::size_t closed = 0;   ///< closed, not convex: triangles
  std::size_t open = 0;  ///< with a border, or edges that more than two triangles share: triangles
};

struct SceneReport {
  std::size_t objects = 0;       ///< pieces of others left out
  std::size_t solidObjects = 0;  ///< with an area, so that they can be touched
  std::size_t meshes = 0;
  std::size_t triangles = 0;        ///< of all objects
  std::size_t uniqueTriangles = 0;  ///< of all meshes
  std::size_t uniquePositions = 0;
  ShellCounts shells;
  std::size_t hullTriangles = 0;  ///< triangles of all objects for which a hull stands
  std::size_t partTriangles = 0;  ///< triangles that stay for collision
  /// The importer's, then those that the geometry shows; counts of meshes are of each mesh once.
  std::vector<Problem> problems;
};

/// The box of an object as it was authored, still or not; empty when it has no area.
Box boxOf(const Scene& scene, std::uint32_t object);

/// Works out every shape; parts of still objects are not built.
SceneReport reportOn(const Scene& scene);

}  // namespace enfilade::scene
