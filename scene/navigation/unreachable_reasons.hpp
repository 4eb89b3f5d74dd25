// Explains an unreachable goal: the obstruction on the way, and the clearance, step or drop there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "scene/navigation/mesh/navigation_mesh.hpp"
#include "scene/navigation/path_finder.hpp"
#include "scene/navigation/walk/walker.hpp"

namespace enfilade::scene {

/// The closest places of two parts of a mesh.
struct PartGap {
  std::uint32_t fromPart = 0, toPart = 0;
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();  ///< scene frame, metres
  Vec3 across = Vec3::UnitX();                  ///< horizontal, unit, out of `fromPart`
  bool hasRoom = true;  ///< an agent fits near both ends: not on a ledge, say

  /// metres; gaps between places with room come first
  double cost() const;
  PartGap reversed() const { return {toPart, fromPart, to, from, -across, hasRoom}; }
};

/// The mesh of Clearance::none and its parts. Also the closest places of parts that are near each
/// other, with room for an agent if there are any.
struct UnobstructedMesh {
  std::shared_ptr<const NavigationMesh> mesh;  ///< not null
  std::vector<std::uint32_t> partOf;           ///< by polygon
  std::vector<PartGap> gaps;  ///< at most one from a part to another; ascending by `fromPart`

  std::size_t memoryBytes() const {  ///< without the mesh
    return partOf.size() * sizeof(partOf[0]) + gaps.size() * sizeof(PartGap);
  }
};
/// `walkable`: the mesh where agents fit.
UnobstructedMesh makeUnobstructedMesh(std::shared_ptr<const NavigationMesh> mesh,
                                      const NavigationMesh& walkable);

/// The end of a walk that did not arrive, as the reason of `path`. It has the entity, and its clear
/// width or height, the step or the drop. The walk led from `from` to a place `beyond` the
/// obstacle. `line`: the places around, along the path.
void explainStop(const PathFinder& finder, const WalkOutcome& stop, const Vec3& from,
                 const Vec3& beyond, const std::vector<Vec3>& line, NavigationPath& path);

/// Explains `path` by the first gap that stops the walker, of the shortest sequence of gaps of the
/// unobstructed mesh that leads to the goal. Returns false if no gap does.
bool explainGaps(const PathFinder& finder, const MeshPoint& from, const MeshPoint& to,
                 NavigationPath& path);

}  // namespace enfilade::scene
